"""The contract of tools. Subclass it and give the fixture `tool`.

The tool is taken up by an artist in a script (`contact_core.testing.artist`): a ball with the patch "spot", which
is selected, and a hand with the patch "pad", paired with its copy on the ball. Drags begin on patches, beside them
on the ball and on the hand, and lead from patch to patch.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.document.schema import document_to_json, inconsistencies
from contact_core.interaction.actions import ACTIONS
from contact_core.interaction.events import Key, Modifier, Pointer
from contact_core.interaction.overlay import Overlay
from contact_core.interaction.tool import Tool
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager
from contact_core.testing.artist import Artist, paired
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

DRAGS = ("patch", "ball", "hand", "across")
HELD: tuple[tuple[Modifier, ...], ...] = ((), ("shift",), ("ctrl",))


class _Offered:
    """A plugin that offers one tool."""

    def __init__(self, tool: Tool) -> None:
        self.tool = tool

    @hookimpl
    def contact_tools(self) -> list[object]:
        return [self.tool]


def artist_with(tool: Tool) -> Artist:
    """Somebody who has the tool in the hand and the patch "spot" selected."""
    artist = paired(plugins=_plugins_with(tool))
    artist.hands.set(iterations=2, penetration=False)
    artist.hands.take_up(tool.name)
    artist.hands.select("spot")
    return artist


_managers: dict[tuple[type, str], tuple[Tool, PluginManager]] = {}


def _plugins_with(tool: Tool) -> PluginManager:
    """Plugins with the tool; made once for tools that are spelt alike."""
    key = type(tool), repr(tool)
    if key not in _managers:
        manager = PluginManager()
        manager.register(_Offered(tool), "the tool under test", replaces=(tool.name,))
        _managers[key] = tool, manager
    return _managers[key][1]


@cache
def drag(name: str) -> FloatArray:
    """(k, 2) pixels of a drag by name."""
    artist = paired()
    spot = artist.pixel("ball", artist.session.geometry.points("spot"))
    pad = artist.pixel("hand", artist.session.geometry.points("pad"))
    line = np.array([[0.0, 0.0], [5.0, -3.0], [13.0, 9.0], [2.0, 14.0]])
    if name in ("across", "siblings"):
        copy = artist.pixel("ball", artist.session.geometry.points("copy"))
        first, last = (pad[12], spot[18]) if name == "across" else (spot[18], copy[3])
        return np.stack([first, 0.5 * (first + last), last])
    return line + {"patch": spot[18], "ball": spot[12] + [10.0, 75.0], "hand": pad[12]}[name]


def dragged(artist: Artist, name: str, held: tuple[Modifier, ...] = ()) -> bool:
    """Press, move and let go; whether the press was taken."""
    pixels = drag(name)
    taken = artist.press(pixels[0], *held)
    for pixel in pixels[1:]:
        artist.move(pixel, *held)
        artist.hands.advance()
    artist.release(pixels[-1], *held)
    return taken


def content(artist: Artist) -> object:
    """Of the document, to compare."""
    return document_to_json(artist.session.document)


class ToolContract(Contract):
    """Fixture: `tool`, a Tool."""

    about, letter = "tool", "U"

    def test_u01_is_named(self, tool: Tool) -> None:
        """Has a name, says in a sentence what it does and how to use it, and wants a key that there is, or none."""
        assert tool.name == tool.name.strip() != ""
        assert len(tool.summary.split()) >= 3, tool.summary
        assert len(tool.hint.split()) >= 2, tool.hint
        assert tool.key == "" or Key(tool.key.split("+")[-1]).name == tool.key.split("+")[-1]
        assert tool.key not in {key for action in ACTIONS for key in action.keys}, (
            "an action of the core has this key"
        )

    def test_u02_declares_its_settings(self, tool: Tool) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(tool)

    def test_u03_hovering_changes_nothing(self, tool: Tool) -> None:
        """Hovering draws, and leaves document and selection alone."""
        artist = artist_with(tool)
        document, selection = artist.session.document, artist.hands.selection
        for name in DRAGS:
            for pixel in (*drag(name), (3.0, 3.0)):
                assert not artist.move(pixel)
                _check_overlay(artist)
        assert artist.session.document is document and artist.session.revision == 0
        assert artist.hands.selection is selection and artist.hands.desk.command is None

    def test_u04_leaves_presses_beside_everything_to_the_camera(self, tool: Tool) -> None:
        """A press where there is nothing is not taken."""
        artist = artist_with(tool)
        document = artist.session.document
        assert not artist.press((3.0, 3.0)) and not artist.hands.is_busy
        artist.move((9.0, 9.0))
        artist.release((9.0, 9.0))
        assert artist.session.document is document

    @pytest.mark.parametrize("name", DRAGS)
    def test_u05_a_drag_is_at_most_one_step(self, tool: Tool, name: str) -> None:
        """Whatever is dragged with whatever modifier is one undo step or none, and nothing stays under way."""
        for held in HELD:
            artist = artist_with(tool)
            document = artist.session.document
            taken = dragged(artist, name, held)
            assert artist.session.revision <= 1 and not artist.hands.is_busy
            assert taken or artist.session.document is document
            assert not list(inconsistencies(artist.session.document))
            if artist.session.revision:
                artist.session.undo()
                assert artist.session.document is document

    @pytest.mark.parametrize("name", DRAGS)
    def test_u06_escape_puts_everything_back(self, tool: Tool, name: str) -> None:
        """After Escape in the middle of a drag the document is the very same one."""
        artist = artist_with(tool)
        document, pixels = artist.session.document, drag(name)
        artist.press(pixels[0])
        for pixel in pixels[1:]:
            artist.move(pixel)
            artist.hands.advance()
            _check_overlay(artist)
        artist.key("Escape")
        assert artist.session.document is document and artist.session.revision == 0
        artist.release(pixels[-1])
        assert artist.session.document is document

    def test_u07_is_deterministic(self, tool: Tool) -> None:
        """The same events on the same document leave the same document."""
        for name in DRAGS:
            artists = artist_with(tool), artist_with(tool)
            for artist in artists:
                dragged(artist, name)
            assert content(artists[0]) == content(artists[1])

    @needs("edits")
    def test_u08_edits(self, tool: Tool) -> None:
        """One of the drags is a step, with a title."""
        titles = []
        for name in (*DRAGS, "siblings"):
            artist = artist_with(tool)
            artist.session.listen(lambda change: titles.append(change.command) if change.kind == "do" else None)
            dragged(artist, name)
        assert titles, "no drag edited anything"
        assert all(command is not None and command.label().strip() for command in titles)

    @needs("comes_back")
    @pytest.mark.parametrize("name", DRAGS)
    def test_u09_there_and_back_is_nothing(self, tool: Tool, name: str) -> None:
        """A drag that comes back to the pixel of its press is no step."""
        artist = artist_with(tool)
        document, pixels = artist.session.document, drag(name)
        artist.press(pixels[0])
        for pixel in (*pixels[1:], *pixels[-2::-1]):
            artist.move(pixel)
            artist.hands.advance()
        artist.release(pixels[0])
        assert artist.session.document is document

    def test_u10_bears_a_rough_hand(self, tool: Tool) -> None:
        """Presses without ends, leaps off the screen and other buttons raise nothing and corrupt nothing."""
        artist, random = artist_with(tool), np.random.default_rng(7)
        for name in DRAGS:
            for button in ("left", "right", "left"):
                artist.pointer("press", drag(name)[0], button)
                artist.move((1e7, -1e7))
                artist.hands.advance()
                artist.move(drag(name)[1])
            artist.pointer("release", (-1e7, 1e7), "left")
            artist.hands.cancel()
        spots = np.concatenate([drag(name) for name in DRAGS])
        for _ in range(60):
            kind = str(random.choice(("press", "move", "move", "release", "wheel", "leave")))
            button = (
                str(random.choice(("left", "left", "right", "middle"))) if kind in ("press", "release") else "none"
            )
            at = random.choice(spots) + random.normal(0.0, 20.0, 2) if random.random() < 0.9 else [1e7, -1e7]
            held = frozenset(random.choice(("ctrl", "shift"), random.integers(0, 2)).tolist())
            event = Pointer(kind, float(at[0]), float(at[1]), button, held)  # type: ignore[arg-type]
            artist.hands.handle(event, artist.view)
            artist.hands.advance()
        artist.hands.cancel()
        assert artist.hands.desk.command is None and not list(inconsistencies(artist.session.document))

    def test_u11_heeds_what_is_worked_on(self, tool: Tool) -> None:
        """While tools work on the hand, a drag over the ball alone edits nothing that lies on the ball."""
        artist = artist_with(tool)
        artist.hands.select(surface="hand")
        before = artist.session.document
        dragged(artist, "ball")
        after = artist.session.document
        for name, patch in before.patches.items():
            if patch.surface == "ball":
                assert after.patches.get(name) == patch, name


def _check_overlay(artist: Artist) -> None:
    """What is to be drawn can be drawn: positions are finite points of the world, sizes and colours in range."""
    overlay = artist.hands.overlay()
    assert isinstance(overlay, Overlay)
    for item in _items(overlay):
        for field in dataclasses.fields(item):
            value = getattr(item, field.name)
            if isinstance(value, np.ndarray) and value.dtype == np.float64 and field.name != "distances":
                assert np.isfinite(value).all() and value.shape[-1] == 3, (type(item).__name__, field.name)
            if field.name == "color":
                assert len(value) == 3 and all(0.0 <= part <= 1.0 for part in value), value
            if field.name in ("radius", "width"):
                assert 0.0 < value < np.inf, (type(item).__name__, field.name, value)
    names = [handle.name for handle in overlay.handles]
    assert len(set(names)) == len(names), names


def _items(overlay: Overlay) -> Iterator[Any]:
    for field in dataclasses.fields(overlay):
        value = getattr(overlay, field.name)
        yield from value if isinstance(value, tuple) else () if value is None else (value,)
