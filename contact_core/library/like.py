"""Suggestions that begin with a saved grasp: at the places most like its own first, then others of its kind."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contact_core.document.library import ContactSet
from contact_core.errors import InvalidInput
from contact_core.grasping.finishing import Suggestion
from contact_core.grasping.scene import GraspScene
from contact_core.grasping.searching import GraspSettings
from contact_core.grasping.suggest import suggest
from contact_core.library.applying import apply
from contact_core.library.record import Grasp
from contact_core.progress import NO_PROGRESS, Progress

ALIKE = 0.011  # hand lengths: as `suggest` tells grasps apart


def suggest_like(
    scene: GraspScene,
    grasp: Grasp,
    contacts: ContactSet,
    settings: GraspSettings,
    progress: Progress = NO_PROGRESS,
) -> Iterator[Suggestion]:
    """As `suggest`, with those first that are the saved grasp at one of its like places and pass the verdict.

    Where fewer are wanted than there are, no others are looked for; others are of the saved grasp's kind unless
    `settings` names kinds. Raises as `suggest` does.
    """
    given = list[Suggestion]()
    own = replace(scene, prior="current")
    at = None if settings.at is None else np.array(settings.at, float)
    try:
        found = apply(own, grasp, contacts, at=at, count=settings.count, progress=progress.part(0.0, 0.5))
    except InvalidInput:  # it has no place here: what follows is of its kind
        found = []
    for one in found:
        new = one.suggestion.is_grasp and not any(_alike(scene, one.suggestion, other) for other in given)
        if new:
            given.append(one.suggestion)
            yield one.suggestion
    left = settings.count - len(given)
    if left <= 0:
        return
    more = replace(settings, count=left, kinds=settings.kinds or (grasp.kind,))
    for other in suggest(scene, more, progress.part(0.5, 1.0)):
        if not any(_alike(scene, other, before) for before in given):
            yield other


def _alike(scene: GraspScene, one: Suggestion, other: Suggestion) -> bool:
    return float(np.abs(one.seen - other.seen).mean()) < ALIKE * scene.hand.length
