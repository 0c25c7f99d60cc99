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
    away from a right hand's thumb); None: between the pads of the fingers, `half` before them. axis, across: the
    palm's directions along which z and x of the thing lie; "line" runs from the first finger's pad to the last's,
    "normal" the way they look. thumb: (3,) millimetres in the palm's frame, where the thumb's pad is to be; None:
    opposite the fingers' pads; () for a thumb as it is bent by `thumb_bends`, or as it closes. pads: "tips", "all",
    or names. spread: degrees, of each finger. sides: pads on the sides of fingers beside those: role, segment, and
    1 for the side of the thumb, -1 for the other. lead: the fingers whose pads place the thing, those that take
    part by default, or "side". closes: by digit, thumb first, how far it may close joint by joint, of its room;
    None: as bent, until it touches.
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
                  rod(14, 170), _same(0, 0, 0), WHOLE, at=(24, 22, 0), axis=tilted, thumb=(34, 10, -34), palm=True,
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
                  rod(6, 150), ((46, 30, 15), (52, 34, 18), (50, 34, 18), (44, 28, 14)), WHOLE, half=6, axis="line",
                  pads="tips"),
        GraspType("prismatic 3 finger", 7, "precision", ("rod", pad), "A rod by three fingers.",
                  rod(5, 120), ((46, 30, 15), (52, 34, 18), (50, 34, 18), (30, 20, 10)), four, half=5, axis="line",
                  pads="tips"),
        GraspType("prismatic 2 finger", 8, "precision", ("rod", pad), "A pencil that is picked up.",
                  rod(4, 120), ((46, 30, 15), (52, 34, 18), (28, 24, 12), (22, 20, 10)), three, half=4, axis="line",
                  pads="tips"),
        GraspType("palmar pinch", 9, "pinch", ("coin", pad), "A coin or a button.",
                  rod(15, 8), ((48, 30, 14), (20, 18, 9), (16, 16, 8), (12, 14, 8)), tip, half=4, axis="normal",
                  pads="tips"),
        GraspType("power disk", 10, "power", ("disk", palm), "A jar's lid in the palm.",
                  rod(46, 20), _same(18, 42, 30), WHOLE, at=(22, 28, 0), axis=(1, 0, 0), thumb=(16, 2, -42),
                  palm=True, spread=(-10, -3, 4, 10)),
        GraspType("power sphere", 11, "power", ("ball", palm), "A ball that is thrown.",
                  ball(36), _same(30, 36, 20), WHOLE, at=(38, 28, 0), thumb=(58, 6, -26), palm=True,
                  spread=(-10, -3, 4, 10)),
        GraspType("precision disk", 12, "precision", ("disk", pad), "A lid that is turned.",
                  rod(40, 16), _same(30, 25, 12), WHOLE, at=(54, 34, 2), axis=(1, 0, 0), thumb=(54, 2, -24),
                  pads="tips", spread=(-14, -4, 6, 14)),
        GraspType("precision sphere", 13, "precision", ("ball", pad), "A ball by the fingertips.",
                  ball(30), ((40, 28, 14), (40, 28, 14), (40, 28, 14), (40, 28, 14)), WHOLE, at=(64, 42, 0),
                  thumb=(66, 16, -16), pads="tips", spread=(-8, -2, 4, 8)),
        GraspType("tripod", 14, "precision", ("small ball", pad), "A small ball between three tips.",
                  ball(15), ((48, 32, 16), (48, 34, 16), curled, curled), three, half=15, pads="tips"),
        GraspType("fixed hook", 15, "hook", ("bar", palm, "no thumb"), "A suitcase's handle.",
                  rod(11, 140), _same(8, 72, 45), WHOLE[1:], at=(10, 60, 0),
                  pads=tuple(f"{finger} intermediate" for finger in WHOLE[1:])),
        GraspType("lateral", 16, "lateral", ("card", side, "adducted thumb"), "A key or a card.",
                  plate(80, 50, 4), _same(50, 62, 38), tip, half=2, axis="normal", across=(1, 0.5, 0),
                  lead=("side",), pads=("thumb tip",), sides=(("index", "intermediate", 1.0),)),
        GraspType("extension type", 18, "power", ("plate", pad), "A plate or a pizza box.",
                  plate(130, 100, 12), _same(58, -10, -8), WHOLE, half=6, axis="normal"),
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
                  ball(25), ((44, 30, 15), (46, 32, 15), (46, 32, 15), curled), four, half=25,
                  spread=(-4, 0, 4, 4)),
        GraspType("quadpod", 27, "precision", ("small ball", pad), "A small ball by four tips.",
                  ball(20), ((47, 32, 16), (47, 34, 16), (47, 34, 16), curled), four, half=20, pads="tips"),
        GraspType("sphere 3 finger", 28, "precision", ("ball", pad), "A ball by three digits.",
                  ball(26), ((46, 30, 15), (46, 32, 15), curled, curled), three, half=26, spread=(-14, 6, 4, 4)),
        GraspType("ring", 31, "pinch", ("cylinder", pad), "A glass between thumb and index.",
                  rod(28, 80), ((40, 42, 22), (20, 20, 10), (16, 18, 9), (14, 16, 8)), tip, half=28),
    )  # fmt: skip


def _same(a: float, b: float, c: float) -> tuple[Bends, Bends, Bends, Bends]:
    """All four fingers bent alike."""
    return ((a, b, c),) * 4
