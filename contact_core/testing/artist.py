"""An artist in a script: a session with a ball and a rigged hand, a camera of numpy, and events by name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.events import Button, Key, Modifier, Pointer
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.view import Perspective
from contact_core.plugins.manager import PluginManager
from contact_core.rig.rig import Rig
from contact_core.session import Session
from contact_core.testing import meshes, rigs

FRONT = Perspective.looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 7.0), viewport=(800, 600))


@dataclass
class Artist:
    """Somebody with a pointer and keys, at one view."""

    session: Session
    hands: Interaction
    view: Perspective = FRONT

    def at(self, place: Any) -> FloatArray:
        """The pixel of a world point."""
        return self.view.project(np.asarray(place, float)[None])[0, :2]

    def pixel(self, surface: str, points: SurfacePoints) -> FloatArray:
        """(k, 2) the pixels of surface points where they are seen."""
        return self.view.project(self.hands.desk.scene.surfaces[surface].positions(points))[:, :2]

    def point(self, surface: str, pixel: FloatArray) -> SurfacePoints:
        """The point of a surface under a pixel."""
        hit = self.hands.desk.scene.pick(self.view, np.asarray(pixel, float), (surface,))
        assert hit is not None
        return hit.point

    def pointer(self, kind: Any, pixel: Any, button: Button = "none", *held: Modifier) -> bool:
        return self.hands.handle(
            Pointer(kind, float(pixel[0]), float(pixel[1]), button, frozenset(held)), self.view
        )

    def press(self, pixel: Any, *held: Modifier) -> bool:
        return self.pointer("press", pixel, "left", *held)

    def move(self, pixel: Any, *held: Modifier) -> bool:
        return self.pointer("move", pixel, "none", *held)

    def release(self, pixel: Any, *held: Modifier) -> bool:
        return self.pointer("release", pixel, "left", *held)

    def drag(self, *pixels: Any, held: tuple[Modifier, ...] = ()) -> None:
        """Press at the first, over all others, and let go at the last."""
        assert self.press(pixels[0], *held), self.hands.status
        for pixel in pixels[1:]:
            self.move(pixel, *held)
            self.hands.advance()
        self.release(pixels[-1], *held)

    def key(self, chord: str) -> bool:
        *held, name = chord.split("+")
        return self.hands.handle(Key(name, frozenset(each.lower() for each in held)), self.view)  # type: ignore[misc]


def block(mesh: TriangleMesh, centre: Any, half: float = 0.25, count: int = 5) -> SurfacePoints:
    """count by count points of a mesh nearest to a square round `centre` that faces +z."""
    steps = np.linspace(-half, half, count)
    grid = np.asarray(centre, float) + np.array([[x, y, 0.0] for x in steps for y in steps])
    return Locator.of(mesh).closest(grid).points


def ball_and_hand(**arguments: Any) -> Artist:
    """A ball of radius 1 with the patch "spot", and beside it a hand of four joints in quarter meters, a tentacle
    two long, with the patch "pad": both face the eye. They are not paired. arguments: of the session; by default
    it shares its plugins with all others."""
    return _artist(_unpaired(), arguments)


def paired(**arguments: Any) -> Artist:
    """The same, the pad paired with a copy of it on the ball: the hand follows what is dragged."""
    return _artist(_paired(), arguments)


def _artist(document: ContactDocument, arguments: dict[str, Any]) -> Artist:
    session = Session(document, **(arguments or {"plugins": _plugins()}))
    for name, mesh in _meshes().items():
        session.surfaces.add(name, mesh, rig=_rig() if name == "hand" else None)
    return Artist(session, Interaction(session))


@cache
def _plugins() -> PluginManager:
    return PluginManager()


@cache
def _rig() -> Rig:
    return rigs.tentacle(4)


@cache
def _meshes() -> dict[str, TriangleMesh]:
    return {"hand": _rig().surface, "ball": meshes.icosphere(3)}


@cache
def _unpaired() -> ContactDocument:
    session, skin, ball = Session(plugins=_plugins()), _meshes()["hand"], _meshes()["ball"]
    session.surfaces.add("hand", skin, rig=_rig(), meters_per_unit=0.25, world_from_surface=shifted(0.8, -4.0, 0.0))
    session.surfaces.add("ball", ball, world_from_surface=shifted(-1.1, 0.0, 0.0))
    top = (0.0, 0.0, 1.0)
    session.patches.paint(
        "spot", block(ball, top), surface="ball", axis=ends(ball, (0.0, -0.3, 1.0), (0.0, 0.3, 1.0))
    )
    pad = block(skin, (7.1, 0.0, 0.5), 0.35)
    session.patches.paint("pad", pad, surface="hand", axis=ends(skin, (6.8, 0.0, 0.5), (7.5, 0.0, 0.5)))
    return session.document


@cache
def _paired() -> ContactDocument:
    session = _artist(_unpaired(), {}).session
    session.patches.transfer(
        "pad", "ball", ends(_meshes()["ball"], (0.6, -0.3, 0.8)), direction=(0.0, 1.0, 0.0), name="copy"
    )
    session.pairs.add("pad", "copy")
    return session.document


def ends(mesh: TriangleMesh, *places: Any) -> SurfacePoints:
    """The points of a mesh nearest to places."""
    return Locator.of(mesh).closest(np.array(places, float)).points


def shifted(*offset: float) -> FloatArray:
    """(4, 4) a translation, in units of the surface."""
    there = np.eye(4)
    there[:3, 3] = offset
    return there
