"""The score "balanced": contact first, then a hold, then comfort and a free way out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from contact_core.grasping.slots import GraspFacts
from contact_core.settings import HasSettings, setting

FIRM = 0.15  # closure from which more is no better: it is a floor, not an order
IN_THE_AIR = 0.08  # hand lengths from the object at which a thumb's end is in the air for sure
FAILURE = 0.6  # what each failure costs


@dataclass(frozen=True)
class Balanced(HasSettings):
    """A weighted sum; every part is 0 to 1 but the price of failures."""

    name: ClassVar[str] = "balanced"
    summary: ClassVar[str] = "contact, hold, comfort and a free way out, weighed"
    contact: float = setting(1.0, low=0.0, help="what close contact of many pads counts")
    hold: float = setting(1.0, low=0.0, help="what digits that touch and closure count")
    comfort: float = setting(0.7, low=0.0, help="what joints in the middle of their room and like bends count")
    loop: float = setting(
        0.25,
        low=0.0,
        help="what each finger through a loop to hold counts, and a thumb beside it costs",
    )
    scissors: float = setting(0.5, low=0.0, help="what the thumb through one loop and a finger in another count")
    along: float = setting(0.7, low=0.0, help="what a thumb costs that lies along what the fingers go round")
    raised: float = setting(0.6, low=0.0, help="what a thumb costs whose end is in the air")
    margin: float = setting(0.3, low=0.0, help="what it costs that the verdict hangs on a limit")
    clearance: float = setting(0.3, low=0.0, help="what a free way out counts")

    def score(self, facts: GraspFacts) -> float:
        m = facts.metrics
        far = min((m["mean_contact_distance"] or 0.0) / 0.025, 2.0)
        contact = m["pads_placed"] * (1.0 - 0.5 * far) * (m["opposed_normals_45"] or 0.0)
        digits = m["digits_in_contact"] / max(m["digits_wanted"], 1)
        hold = 0.5 * digits + 0.5 * min(max(facts.closure, 0.0) / FIRM, 1.0)
        thumb = "thumb" in m["through_loop"]
        value = self.contact * contact + self.hold * hold + self.comfort * facts.comfort
        if facts.kind not in ("pinch", "lateral") and not thumb:  # its loop says where it goes
            value -= self.along * m["thumb_along"]
        value -= self.raised * min(m["thumb_away"] / IN_THE_AIR, 1.0)
        if not facts.failures:
            value -= self.margin * (1.0 - facts.margin)
            value += self.loop * min(m["digits_through"] - thumb, 4)
        if thumb:  # as scissors are held, or in the way of the fingers
            value += self.scissors if m["loops_held"] > 1 else -self.loop
        return float(value + self.clearance * facts.clearance - FAILURE * len(facts.failures))
