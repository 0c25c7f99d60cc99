"""The verb of a session that suggests grasps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from contact_core.errors import InvalidInput
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.verbs import ProposingSession

if TYPE_CHECKING:
    from contact_core.grasping.finishing import Suggestion
    from contact_core.grasping.scene import GraspScene
    from contact_core.grasping.searching import GraspSettings
    from contact_core.grasping.slots import Kind
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
        from contact_core.grasping.searching import GraspSettings
        from contact_core.grasping.suggest import suggest

        chosen = settings or GraspSettings(count, tuple(kinds), at, seed)
        for found in suggest(grasp_scene(self, hand, thing, words), chosen, progress):
            self.show_ghost(found.proposal)
            yield found


def grasp_scene(session: ProposingSession, hand: str, thing: str, words: Sequence[HandWords] = ()) -> GraspScene:
    """What `suggest` works on: the document as the scene has it now, the hand as it describes itself."""
    return grasp_scene_of(session, hand, thing, words)()


def grasp_scene_of(
    session: ProposingSession, hand: str, thing: str, words: Sequence[HandWords] = ()
) -> Callable[[], GraspScene]:
    """`grasp_scene` in two: the scene is read now, the hand looked at in the call, which may be on any thread."""
    from contact_core.grasping.hand import hand_of
    from contact_core.grasping.scene import GraspScene
    from contact_core.hands.describe import describe_hand

    for name in (hand, thing):
        session.document.surface(name)
    if hand not in session.rigs:
        raise InvalidInput(f"{hand!r} has no rig that can be posed, so it is no hand.")
    if hand == thing or thing in session.rigs:
        raise InvalidInput(f"{thing!r} bends; grasps are suggested on surfaces that stay as they are.")
    draft, derived, rigs = session._draft(), session.derived.apart(), dict(session.rigs)
    plugins, revision = session.plugins, session.revision

    def scene() -> GraspScene:
        described = hand_of(rigs[hand], describe_hand(rigs[hand], words))
        return GraspScene(draft.document, derived, rigs, described, hand, thing, plugins, revision, draft.evaluated)

    return scene
