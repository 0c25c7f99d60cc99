"""What the starter library holds: 25 of the types of the GRASP taxonomy, each in a few words and numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

from contact_core.geometry.solids import Solid, rounded_box, rounded_cylinder, sphere
from contact_core.grasping.slots import Kind

WHOLE = ("thumb", "index", "middle", "ring", "little")
FINGERS = WHOLE[1:]
Bends = tuple[float, float, float]  # degrees that a finger's joints are bent from rest, from the knuckle on


@dataclass(frozen=True)
class GraspType:
    """A type of grasp. number: in the taxonomy. solid: what is held, in metres. bends: of the index to the little
    finger. digits: those that take part.

    at: the middle of the thing in the palm's frame, millimetres (x out of the palm, y along the fingers, z across,
    away from a right hand's thumb); None: between the pads of the fingers, `half` before them as they are bent,
    from where fitting brings both to touch. axis, across: the palm's directions along which z and x of the thing
    lie; "line" runs from the first finger's pad to the last's, "normal" the way they look. thumb: (3,) millimetres
    in the palm's frame, where the thumb's pad is to be; None: opposite the fingers' pads; () for a thumb as it is
    bent by `thumb_bends`, or as it closes. pads: "tips", "all", or names. spread: degrees, of each finger. sides:
    pads on the sides of fingers beside those: role, segment, and 1 for the side of the thumb, -1 for the other.
    lead: the fingers whose pads place the thing, those that take part by default, or "side". closes: by digit,
    thumb first, how far it may close joint by joint, of its room; None: as bent, until it touches.
    """

    name: str
    number: int
    kind: Kind
    tags: tuple[str, ...]
    note: str
    solid: Callable[[], Solid]
    bends: tuple[Bends, Bends, Bends, Bends]
    digits: tuple[str, ...]
    at: tuple[float, float, float] | None = None
    half: float = 0.0
    axis: tuple[float, float, float] | Literal["line", "normal"] = (0.0, 0.0, 1.0)
    across: tuple[float, float, float] = (0.0, 1.0, 0.0)
    thumb: tuple[float, ...] | None = None
    thumb_bends: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    pads: str | tuple[str, ...] = "all"
    palm: bool = False
    spread: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lead: tuple[str, ...] = ()
    closes: tuple[float, float, float, float, float] | None = None
    sides: tuple[tuple[str, str, float], ...] = field(default=())
    fit: bool = True


def starter_types() -> tuple[GraspType, ...]:
    """What the starter library is made from (`starter_making`). Index finger extension (17) was tried and
    left out, for it did not look right; distal type, tripod variation, lateral tripod, stick, palmar, ventral and
    inferior pincer (19, 21, 25, 29, 30, 32, 33) were not tried."""

    def rod(radius: float, height: float) -> partial[Solid]:
        return partial(rounded_cylinder, radius * 1e-3, height * 1e-3, min(3e-3, 0.4e-3 * radius), 5e-3)

    def ball(radius: float) -> partial[Solid]:
        return partial(sphere, radius * 1e-3)

    def plate(x: float, y: float, z: float) -> partial[Solid]:
        return partial(rounded_box, x * 1e-3, y * 1e-3, z * 1e-3, min(3e-3, 0.4e-3 * min(x, y, z)), 5e-3)

    tilted = (0.0, -0.25, 1.0)
    tip = ("thumb", "index")
    three, four = (*tip, "middle"), (*tip, "middle", "ring")
    curled: Bends = (55.0, 65.0, 40.0)
    wrap = (1.0, 1.0, 1.0, 1.0, 1.0)
    palm, pad, side = "palm opposition", "pad opposition", "side opposition"
    return (
        GraspType("large diameter", 1, "power", ("cylinder", palm), "A wide bottle or a tin.",
                  rod(38, 170), _same(25, 30, 15), WHOLE, at=(44, 20, 0), axis=tilted, thumb=(60, -16, -36),
                  palm=True, closes=wrap),
        GraspType("small diameter", 2, "power", ("cylinder", palm), "A thin bar or a broom.",
                  rod(14, 170), _same(0, 0, 0), WHOLE, at=(26, 14, -2), axis=tilted, thumb=(32, 18, -31), palm=True,
                  closes=wrap),
        GraspType("medium wrap", 3, "power", ("cylinder", palm), "A handrail or a racket.",
                  rod(21, 170), _same(0, 0, 0), WHOLE, at=(30, 22, 0), axis=tilted, thumb=(48, 4, -34), palm=True,
                  closes=wrap),
        GraspType("adducted thumb", 4, "power", ("stick", palm, "adducted thumb"), "A stick that points.",
                  rod(12, 190), _same(0, 0, 0), WHOLE, at=(22, 20, 0), axis=(0.1, -0.55, 1.0), thumb=(30, 42, -50),
                  palm=True,
                  closes=wrap),
        GraspType("light tool", 5, "power", ("stick", palm), "A thin handle.",
                  rod(9, 180), _same(0, 0, 0), WHOLE, at=(18, 26, 0), axis=tilted, thumb=(28, 14, -36), palm=True,
                  closes=wrap),
        GraspType("prismatic 4 finger", 6, "precision", ("rod", pad), "A flute or a thin rod.",
                  rod(6, 150), ((7, 58, -2), (13, 62, 1), (11, 62, 1), (5, 56, -3)), WHOLE, half=3.7, axis="line",
                  pads="tips"),
        GraspType("prismatic 3 finger", 7, "precision", ("rod", pad), "A rod by three fingers.",
                  rod(5, 120), ((5, 60, 30), (11, 64, 33), (9, 64, 33), (-11, 50, 25)), four, half=2, axis="line",
                  pads="tips", spread=(-4, -4, 7, -13)),
        GraspType("prismatic 2 finger", 8, "precision", ("rod", pad), "A pencil that is picked up.",
                  rod(4, 120), ((46, 30, 15), (52, 34, 18), (28, 24, 12), (22, 20, 10)), three, half=4, axis="line",
                  pads="tips"),
        GraspType("palmar pinch", 9, "pinch", ("coin", pad), "A coin or a button.",
                  rod(15, 8), ((21, 41, 24), (-7, 29, 19), (-11, 27, 18), (-15, 25, 18)), tip, half=-2.9,
                  axis="normal", pads="tips", spread=(7, -10, -4, 6)),
        GraspType("power disk", 10, "power", ("disk", palm), "A jar's lid in the palm.",
                  rod(46, 20), _same(24, 12, 3), WHOLE, at=(30, 22, -13), axis=(1, 0, 0), thumb=(44, -24, -65),
                  palm=True, spread=(-20, 3, 2, 14)),
        GraspType("power sphere", 11, "power", ("ball", palm), "A ball that is thrown.",
                  ball(36), _same(30, 36, 20), WHOLE, at=(38, 28, 0), thumb=(58, 6, -26), palm=True,
                  spread=(-10, -3, 4, 10)),
        GraspType("precision disk", 12, "precision", ("disk", pad), "A lid that is turned.",
                  rod(40, 16), _same(3, 65, 17), WHOLE, at=(33, 22, 5), axis=(1, 0, 0), thumb=(33, -5, -11),
                  pads="tips", spread=(-10, -5, 20, 24)),
        GraspType("precision sphere", 13, "precision", ("ball", pad), "A ball by the fingertips.",
                  ball(30), ((40, 28, 14), (40, 28, 14), (40, 28, 14), (40, 28, 14)), WHOLE, at=(64, 42, 0),
                  thumb=(66, 16, -16), pads="tips", spread=(-8, -2, 4, 8)),
        GraspType("tripod", 14, "precision", ("small ball", pad), "A small ball between three tips.",
                  ball(15), ((17, 51, -18), (17, 53, -18), (24, 84, 6), (24, 84, 6)), three, half=8.5, pads="tips",
                  spread=(3, -3, 2, 24)),
        GraspType("fixed hook", 15, "hook", ("bar", palm, "no thumb"), "A suitcase's handle.",
                  rod(11, 140), _same(8, 72, 45), WHOLE[1:], at=(10, 60, 0),
                  pads=tuple(f"{finger} intermediate" for finger in WHOLE[1:])),
        GraspType("lateral", 16, "lateral", ("card", side, "adducted thumb"), "A key or a card.",
                  plate(80, 50, 4), _same(50, 62, 38), tip, half=2, axis="normal", across=(1, 0.5, 0),
                  lead=("side",), pads=("thumb tip",), sides=(("index", "intermediate", 1.0),)),
        GraspType("extension type", 18, "power", ("plate", pad), "A plate or a pizza box.",
                  plate(130, 100, 12), _same(19, -5, -8), WHOLE, half=6.3, axis="normal", spread=(-2, -13, 7, 6)),
        GraspType("writing tripod", 20, "lateral", ("pen", side), "A pen that writes.",
                  rod(4.5, 150), ((44, 30, 12), (50, 44, 24), curled, curled), three, half=4.5, lead=("index",),
                  axis=(0.8, 0.5, 0.1), pads=("thumb tip", "index tip"), sides=(("middle", "distal", 1.0),)),
        GraspType("parallel extension", 22, "precision", ("box", pad), "A book or a box.",
                  plate(120, 90, 30), _same(40, -8, -6), WHOLE, half=15, axis="normal"),
        GraspType("adduction grip", 23, "lateral", ("cigarette", side, "no thumb"), "A cigarette.",
                  rod(4, 90), ((12, 14, 8), (12, 14, 8), (26, 30, 16), (30, 34, 18)), ("index", "middle"),
                  at=(4, 84, -27), axis=(1, 0, 0), pads=(),
                  sides=(("index", "intermediate", -1.0), ("middle", "intermediate", 1.0))),
        GraspType("tip pinch", 24, "pinch", ("bead", pad), "A bead.",
                  ball(8), ((50, 50, 32), (26, 24, 12), (20, 20, 10), (16, 16, 8)), tip, half=8, pads="tips"),
        GraspType("sphere 4 finger", 26, "power", ("ball", pad), "A ball by four digits.",
                  ball(25), ((53, 25, 11), (55, 27, 11), (55, 27, 11), (64, 60, 36)), four, half=24.4,
                  spread=(-10, -15, -5, 10)),
        GraspType("quadpod", 27, "precision", ("small ball", pad), "A small ball by four tips.",
                  ball(20), ((30, 18, -3), (30, 20, -3), (30, 20, -3), (38, 51, 21)), four, half=23.9, pads="tips",
                  spread=(1, 4, -9, 4)),
        GraspType("sphere 3 finger", 28, "precision", ("ball", pad), "A ball by three digits.",
                  ball(26), ((53, 27, 22), (53, 29, 22), (62, 62, 47), (62, 62, 47)), three, half=27.1,
                  spread=(-16, 7, 2, 3)),
        GraspType("ring", 31, "pinch", ("cylinder", pad), "A glass between thumb and index.",
                  rod(28, 80), ((32, 63, 15), (12, 41, 3), (8, 39, 2), (6, 37, 1)), tip, half=28.6),
    )  # fmt: skip


def _same(a: float, b: float, c: float) -> tuple[Bends, Bends, Bends, Bends]:
    """All four fingers bent alike."""
    return ((a, b, c),) * 4
