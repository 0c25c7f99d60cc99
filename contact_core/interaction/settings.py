"""What holds for all tools at once, and what is selected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from contact_core.settings import HasSettings, setting

LivePrior: TypeAlias = Literal["rest", "current", "start"]


@dataclass(frozen=True)
class InteractionSettings(HasSettings):
    """Settings of the interaction: live solve, what hides what, how much is shown."""

    live: bool = setting(True, help="the hand follows while contacts are dragged")
    penetration: bool = setting(True, help="skin stays out of the object while the hand follows")
    penetration_weight: float = setting(5.0, low=0.0, help="how much depth counts beside the contacts")
    hollows: bool = setting(True, help="a solve also keeps skin out of hollows in which no contact lies")
    stretch_weight: float = setting(0.5, low=0.0, help="how much skin that is stretched counts beside the contacts")
    prior: LivePrior = setting(
        "rest", help="what joints are pulled to: rest, the pose before each step, or that at the start of the drag"
    )
    prior_weight: float = setting(10.0, low=0.0, help="how strongly joints are pulled there")
    iterations: int = setting(4, low=1, high=1000, help="steps of the solver while the pointer moves")
    solver: str | None = setting(None, help="the pose solver while dragging; the core's own where none is named")
    held: tuple[str, ...] = setting((), help="joints that stay as they are, such as wrist")
    suggestions: int = setting(4, low=1, high=64, help="how many grasps Suggest looks for")
    xray: bool = setting(False, help="see through the surface that tools do not work on")
    isolate: bool = setting(False, help="show only the surface that tools work on")
    heat: bool = setting(False, help="colour the skin by how far it is from the object, or how deep in it")
    handle_gap: float = setting(20.0, low=4.0, unit="pixels", help="how far handles on an axis stay apart")
    labels: bool = setting(True, help="names of the selected patches beside them")


@dataclass(frozen=True)
class Selection:
    """What is selected. patches: names, the active one last. surface: that which tools work on, through all others;
    None: whatever is in front. joint: of the surface's rig."""

    patches: tuple[str, ...] = ()
    surface: str | None = None
    joint: str | None = None

    @property
    def patch(self) -> str | None:
        """The active patch."""
        return self.patches[-1] if self.patches else None
