"""The plugin slots that belong to no lower floor: formats, samples, renderers, placers, jobs, proxy makers,
sub-commands.

The protocols of the other slots live with what they serve: `contact.brush.Brush`,
`contact.axis_generator.AxisGenerator`, `solve.term.PoseTerm`, `solve.solver.PoseSolver`,
`geometry.engine.GeodesicEngine`, `scene.host.HostAdapter`, `interaction.tool.Tool`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

if TYPE_CHECKING:  # so that `contact --help`, which asks for sub-commands, loads no numpy
    import argparse
    from pathlib import Path

    from contact_core.arrays import FloatArray
    from contact_core.document.asset import Asset
    from contact_core.geometry.mesh import TriangleMesh
    from contact_core.geometry.surface_point import SurfacePoints
    from contact_core.plugins.manager import PluginManager
    from contact_core.progress import Progress
    from contact_core.rig.clip import Clip
    from contact_core.rig.rig import Pose, Rig
    from contact_core.scene.picture import Picture


@runtime_checkable
class Format(Protocol):
    """A file format (hook `contact_formats`)."""

    name: str  # "gltf"
    summary: str
    suffixes: tuple[str, ...]  # (".glb", ".gltf"), lower case
    can_read: bool
    can_write: bool

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The asset in a file. Raises FileRefused with a sentence; never anything else for bad input."""
        ...

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        """Write assets, rigs posed by name where given; whole or not at all. Raises FileRefused."""
        ...


@runtime_checkable
class ClipFormat(Format, Protocol):
    """A format that keeps animations, too. What a format inherits or offers beside `Format`, no hook of its own."""

    def read_clips(self, path: Path, *, sidecar: Path | None = None, rate: float | None = None) -> tuple[Clip, ...]:
        """The animations in a file, none where there are none. rate: frames per second; None: what the file says,
        else 24. Raises FileRefused."""
        ...

    def write_clip(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose], clip: Clip | None) -> None:
        """As `write`, with an animation: keys by the names of assets. Raises FileRefused, InvalidInput."""
        ...


@runtime_checkable
class Sample(Protocol):
    """A built-in or third-party sample asset (hook `contact_samples`)."""

    name: str
    kind: Literal["manipulator", "object"]
    summary: str

    def build(self) -> Asset:
        """Deterministic; in seconds."""
        ...


@runtime_checkable
class Renderer(Protocol):
    """Draws a picture off-screen (hook `contact_renderers`)."""

    name: str
    summary: str
    priority: int  # the highest that is available is taken

    def unavailable(self) -> str | None:
        """None when it can draw here, else a sentence with the reason and the cure."""
        ...

    def render(self, pictures: Sequence[Picture], path: Path, *, size: tuple[int, int] = (1280, 720)) -> None:
        """Draw pictures, those of a row (`scene.picture.sheet_rows`) side by side, into one PNG; whole or not."""
        ...


@dataclass(frozen=True, eq=False)
class PlacementRequest:
    """What a placer gets: a posed manipulator, an object, and the patches to place.

    object_from_rig: (4, 4) takes rig space to object surface space. patch_points, patch_axes: per patch name,
    on the manipulator's surface. reach: patches farther away than this are left out, in manipulator lengths; None
    leaves it to the placer. solids: closed surfaces in the object's space whose inside is out of bounds too, such
    as the filled body of a cup.
    """

    rig: Rig
    pose: Pose
    object_mesh: TriangleMesh
    object_from_rig: FloatArray
    patch_points: Mapping[str, SurfacePoints]
    patch_axes: Mapping[str, SurfacePoints]
    reach: float | None = None
    solids: tuple[TriangleMesh, ...] = ()


@dataclass(frozen=True, eq=False)
class PatchPlacement:
    """Where one patch goes: root on the object and the world direction of its axis there (projected)."""

    root: SurfacePoints  # one point
    direction: FloatArray  # (3,) object surface space


@dataclass(frozen=True, eq=False)
class PlacementResult:
    """Placements by patch name, and the patches left out with the reason.

    pose: the pose from which they were placed, where the placer changed the one it was given (closed fingers).
    """

    placed: Mapping[str, PatchPlacement]
    left_out: Mapping[str, str]
    pose: Pose | None = None


@runtime_checkable
class Placer(Protocol):
    """Chooses roots and headings on the object from a coarse pose (hook `contact_placers`).

    Settings of its own are fields, see `contact_core.settings`.
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def place(self, request: PlacementRequest) -> PlacementResult: ...


@dataclass(frozen=True)
class JobRequest:
    """One job of `contact batch`. path: its file. folder: where its results go, made if absent.

    frames: rising, None for the scene as it stands. solver: a name, None leaves the choice to the plugins. assets:
    a folder with files of surfaces, for jobs that name none.
    """

    path: Path
    folder: Path
    frames: tuple[float, ...] | None = None
    solver: str | None = None
    assets: Path | None = None


@dataclass(frozen=True)
class JobOutcome:
    """What a job came to. files: names of its results in the folder. picture: which of them is one.

    badness: 0 is perfect, 1 at the limit of what is accepted; the report sorts by it. failures: sentences on what
    is not accepted. rows: name, value, whether it fails. inputs: files that a library opened without Python, which
    notes what it opens itself.
    """

    files: tuple[str, ...]
    badness: float = 0.0
    failures: tuple[str, ...] = ()
    rows: tuple[tuple[str, str, bool], ...] = ()
    notes: tuple[str, ...] = ()
    picture: str | None = None
    inputs: tuple[Path, ...] = ()


@runtime_checkable
class JobKind(Protocol):
    """A kind of job that `contact batch` runs (hook `contact_job_kinds`), in a worker process without a display."""

    name: str
    summary: str
    suffixes: tuple[str, ...]  # of its files, lower case

    def claims(self, path: Path) -> bool:
        """Whether a file with one of the suffixes, found in a folder, is such a job. Cheap; never raises."""
        ...

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        """Do the job and place its results in the folder: all of them or none; the same again gives the same.

        Raises ContactError in a sentence, Cancelled where progress raises it.
        """
        ...


@runtime_checkable
class ProxyMaker(Protocol):
    """Makes the closed manifold surface that contacts run on where a mesh is broken (hook `contact_proxy_makers`).

    Settings of its own are fields, see `contact_core.settings`; documents keep them.
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def make(self, mesh: TriangleMesh, progress: Progress) -> TriangleMesh:
        """A closed manifold near a mesh, in its units; equal meshes and settings give equal proxies.

        Raises InvalidInput, MissingExtra, Cancelled.
        """
        ...


@runtime_checkable
class CliCommand(Protocol):
    """A sub-command of `contact` (hook `contact_cli`); declared so that --help imports nothing heavy."""

    name: str
    summary: str

    def configure(self, parser: argparse.ArgumentParser) -> None: ...

    def run(self, arguments: argparse.Namespace) -> int: ...
