"""What every group of verbs has at hand, and how each finds out what a command has to hold."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Self, TypeVar

import numpy as np

from contact_core.arrays import IntArray, frozen
from contact_core.contact.axis import Axis, reconstruct_axis
from contact_core.contact.linkage import link_to
from contact_core.contact.patch import parameterize_patch
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import PatchCoordinates
from contact_core.document.document import ContactDocument
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.draft import DocumentDraft
from contact_core.edit.editor import Editor
from contact_core.edit.verbs.proxying import give_proxy
from contact_core.errors import InvalidInput, MissingExtra, NotManifold, Unreached
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology

log = logging.getLogger(__name__)

T = TypeVar("T")
CROWDED = 0.02  # share of a copy's points: fewer may meet at a seam
_CURE = "Transfer them part by part, to places of their own, or scale them down."


def crowding(found: Mapping[str, float]) -> str:
    """A sentence on parts that lie on one another; "" where none do. found: as `DocumentGeometry.crowded` finds."""
    shares = {name: share for name, share in found.items() if share > CROWDED}
    told = ", ".join(f"{name!r} ({100.0 * share:.0f} % of its points)" for name, share in shares.items())
    return f"parts that were apart lie on one another now: {told}. {_CURE}" if told else ""


class VerbGroup:
    """Verbs of an editor: each measures on its geometry, makes a command, and gives the editor that command."""

    def __init__(self, editor: Editor) -> None:
        self._editor = editor

    @property
    def _document(self) -> ContactDocument:
        return self._editor.document

    @property
    def _geometry(self) -> DocumentGeometry:
        return self._editor.geometry

    def _mended(self, surfaces: Iterable[str], act: Callable[[Self], T]) -> T:
        """What these verbs return. Where surfaces are too broken for it, those get proxies, and what the verbs make
        then is one step with it.

        act: takes a group of verbs as this one, of the editor to work in.
        """
        names = [name for name in surfaces if name in self._document.surfaces]
        try:
            return act(self)
        except (NotManifold, Unreached) as error:
            broken = [name for name in names if self._can_be_mended(name, error)]
            if not broken or not self._editor.makers.mends:
                raise
            return self._on_proxies(broken, act, error)

    def _can_be_mended(self, surface: str, error: InvalidInput) -> bool:
        if self._document.surface(surface).proxy is not None:
            return False
        return isinstance(error, Unreached) or not Topology.of(self._geometry.mesh(surface)).is_manifold

    def _on_proxies(self, surfaces: list[str], act: Callable[[Self], T], error: InvalidInput) -> T:
        draft = DocumentDraft.of(self._editor)
        try:
            for surface in surfaces:
                give_proxy(draft, surface)
            result = act(type(self)(draft))
        except MissingExtra as missing:
            raise type(error)(f"{error} {missing}") from error
        except InvalidInput:
            raise error from None  # a proxy is no cure: say what is wrong with the surface
        command = draft.command("Edit on a proxy")
        if command is not None:
            self._editor.do(command)
        return result

    def _measured(self, patch: str, points: SurfacePoints, anchors: IntArray | None = None) -> PatchCoordinates:
        """Coordinates of points of the carrier relative to the axis of a patch as it lies now, as they are before
        its scaling and mirroring. anchors: as for `parameterize_patch`."""
        return parameterize_patch(
            self._geometry.carrier_of(patch),
            self._geometry.axis(patch),
            points,
            anchors=anchors,
            shape=self._document.surface_axis(patch),
            engine=self._editor.derived.engine,
        )

    def _warn_where_crowded(self, copies: Iterable[str]) -> None:
        """Say in the log where parts of what was transferred lie on one another. A stroke previews from its start,
        where the copies are not, and drafts keep quiet, so a drag is not commented on frame by frame."""
        there = [name for name in copies if name in self._document.patches]
        try:
            found = self._geometry.crowded(there)
        except InvalidInput:  # it is committed: what cannot be looked at is not commented on
            return
        if told := crowding(found):
            log.warning("%s", told)

    def _check_axis_point(self, patch: str, point: int) -> None:
        """A patch has this axis point. Raises InvalidInput."""
        count = self._document.shape_of(patch).axis.point_count
        if not 0 <= point < count:
            raise InvalidInput(f"the axis of {patch!r} has the points 0..{count - 1}, but got {point}.")

    def _point_indices(self, patch: str, indices: Any) -> IntArray:
        """(k,) rising, each once, of points that the patch has, k >= 1. Raises InvalidInput for any other."""
        count = len(self._document.shape_of(patch))
        if np.asarray(indices).dtype == bool:
            raise InvalidInput("point indices are whole numbers, but got a mask: pass numpy.flatnonzero(mask).")
        chosen = np.unique(frozen(indices, np.int64, (None,), "point indices"))
        if not len(chosen):
            raise InvalidInput(f"expected indices of points of {patch!r}, but got none.")
        if not 0 <= chosen[0] <= chosen[-1] < count:
            bad = int(chosen[0] if chosen[0] < 0 else chosen[-1])
            raise InvalidInput(f"{patch!r} has the points 0..{count - 1}, but got {bad}.")
        return chosen

    def _relinked(self, child: str, link: Link, point: SurfacePoints, tangent: complex) -> Link:
        """The link that puts the child's linked axis point at `point` with `tangent` there."""
        return link_to(
            self._geometry.carrier_of(child),
            link.parent,
            self._geometry.axis(link.parent),
            point,
            tangent,
            parent_point=link.parent_point,
            own_point=link.own_point,
        )

    def _placement_at(self, patch: str, root: Root) -> Placement:
        """The placement of the patch's own kind that puts its first axis point at `root`."""
        link = self._document.patch(patch).placement
        if not isinstance(link, Link):
            return root
        if link.own_point == 0:
            return self._relinked(patch, link, root.point(), root.heading)
        axis = self._axis_from(patch, root)
        point = axis.points[link.own_point]
        return self._relinked(patch, link, point, complex(axis.tangents[link.own_point]))

    def _axis_from(self, patch: str, root: Root) -> Axis:
        """The axis that the patch would have at another root."""
        return reconstruct_axis(self._geometry.carrier_of(patch), self._document.surface_axis(patch), root)
