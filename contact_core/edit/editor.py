"""What verbs work on: a document with its geometry, and where commands go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from contact_core.contact.axis_generator import AxisGenerator
from contact_core.document.document import ContactDocument, Proxy
from contact_core.edit.command import Command
from contact_core.edit.derived import Derived
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rig import Rig

if TYPE_CHECKING:
    from contact_core.contact.brush import Brush


class Makers:
    """Makes what verbs are given by name, or not at all: brushes, axes, proxies. This one knows no names; that of a
    session asks its plugins.

    mends: whether a verb that fails because a surface is broken gives it a proxy and works on that, in one step.
    """

    mends: bool = False

    def brush(self, name: str, **settings: Any) -> Brush:
        """A brush by name, with its settings. Raises InvalidInput."""
        raise InvalidInput(f"only a session knows brushes by name: make {name!r} there, and pass the brush itself.")

    def axis(
        self,
        geometry: DocumentGeometry,
        surface: str,
        patch: str,
        points: SurfacePoints,
        generator: str | AxisGenerator | None = None,
    ) -> SurfacePoints:
        """Axis points for a patch that was painted without any. Raises InvalidInput."""
        raise InvalidInput(
            f"the patch {patch!r} needs an axis: pass `axis` with one point and a heading, or with more points."
        )

    def proxy(
        self,
        mesh: TriangleMesh,
        maker: str | None = None,
        settings: Mapping[str, Any] | None = None,
        progress: Progress = NO_PROGRESS,
    ) -> tuple[Proxy, TriangleMesh]:
        """A closed manifold near a mesh, and how a document names it. Raises InvalidInput, MissingExtra,
        Cancelled."""
        raise InvalidInput("only a session makes proxies: bring one as a mesh.")


class Editor(Protocol):
    """A document, its geometry, and a place for commands: a session commits them, a stroke previews them, a draft
    keeps them to itself. rigs: by surface."""

    rigs: dict[str, Rig]

    @property
    def document(self) -> ContactDocument:
        """The document that verbs start from."""

    @property
    def timed_document(self) -> ContactDocument:
        """The document with its tracks and spans, of which `document` is a frame."""

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached, and the meshes that were brought."""

    @property
    def geometry(self) -> DocumentGeometry:
        """The geometry of `document`."""

    @property
    def makers(self) -> Makers:
        """Brushes by name, and default axes."""

    def do(self, command: Command, *, origin: str = "user") -> None:
        """Take a command. Raises CommandRejected."""
