"""The verb of a session that suggests grasps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from contact_core.errors import InvalidInput
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.verbs import ProposingSession

if TYPE_CHECKING:
    from contact_core.grasping.slots import Kind
    from contact_core.grasping.suggest import GraspScene, GraspSettings, Suggestion
    from contact_core.hands.description import HandWords


class GraspingSession(ProposingSession):
    """Suggest."""

    def suggest(
        self,
        hand: str,
        thing: str,
        *,
        count: int = 8,
        kinds: Sequence[Kind] = (),
        at: tuple[float, float, float] | None = None,
        seed: int = 0,
        words: Sequence[HandWords] = (),
        settings: GraspSettings | None = None,
        progress: Progress = NO_PROGRESS,
    ) -> Iterator[Suggestion]:
        """Grasps of the surface `thing` by the surface `hand`, as they are found; `accept` takes the `proposal` of
        one, as one undo step, pads, contacts and pose in it.

        kinds: which (`grasping.slots.KINDS`); power, precision, pinch and hook by default. at: (3,) the place
        that is to be held, in the object's surface space. words: what the rig's sidecar says about its hands, the
        first is taken. settings: all of that and more in one value. Nothing is committed. Raises InvalidInput
        where the surface has no hand, or comes near the object nowhere; Cancelled.
        """
        from contact_core.grasping.suggest import GraspSettings, suggest

        chosen = settings or GraspSettings(count, tuple(kinds), at, seed)
        for found in suggest(grasp_scene(self, hand, thing, words), chosen, progress):
            self.show_ghost(found.proposal)
            yield found


def grasp_scene(session: ProposingSession, hand: str, thing: str, words: Sequence[HandWords] = ()) -> GraspScene:
    """What `suggest` works on: the document as the scene has it now, the hand as it describes itsession."""
    from contact_core.grasping.hand import hand_of
    from contact_core.grasping.suggest import GraspScene
    from contact_core.hands.describe import describe_hand

    for name in (hand, thing):
        session.document.surface(name)
    if hand not in session.rigs:
        raise InvalidInput(f"{hand!r} has no rig that can be posed, so it is no hand.")
    if hand == thing or thing in session.rigs:
        raise InvalidInput(f"{thing!r} bends; grasps are suggested on surfaces that stay as they are.")
    draft = session._draft()
    described = hand_of(session.rigs[hand], describe_hand(session.rigs[hand], words))
    return GraspScene(
        draft.document, session.derived, session.rigs, described, hand, thing, session.plugins, session.revision,
        draft.evaluated,
    )  # fmt: skip
