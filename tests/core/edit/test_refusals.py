"""What a verb cannot do it refuses in a sentence, and leaves the document as it was."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.contact.placement import Root
from contact_core.edit.commands import Macro
from contact_core.edit.verbs import SurfaceVerbs, Verbs
from contact_core.errors import ContactError
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.testing.strategies import cached_family

HERE = SurfacePoints([50], [[0.2, 0.3, 0.5]])
NOWHERE = SurfacePoints([10**6], [[0.2, 0.3, 0.5]])
BEFORE_ALL = SurfacePoints([-1], [[0.2, 0.3, 0.5]])
NONE = SurfacePoints([], np.zeros((0, 3)))
NAN = float("nan")
NO_FOLDER = Path(__file__) / "set.json"


def nested(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = [value]
    return value


CASES: list[tuple[str, Callable[[Session], object]]] = [
    ("paint", lambda s: s.paint("new", NONE, surface="torus", axis=HERE, heading=1.0)),
    ("paint", lambda s: s.paint("new", NOWHERE, surface="torus", axis=HERE, heading=1.0)),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=NOWHERE, heading=1.0)),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=NONE, heading=1.0)),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=HERE)),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=HERE, heading=complex(NAN))),
    ("paint", lambda s: s.paint("new", HERE, surface="moon", axis=HERE, heading=1.0)),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, color="red")),  # type: ignore[arg-type]
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, strength=[1.0, 2.0])),
    ("paint", lambda s: s.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, strength=[-1.0])),
    ("paint", lambda s: s.paint("new\n", HERE, surface="torus", axis=HERE, heading=1.0)),
    ("paint", lambda s: s.paint("palm", BEFORE_ALL)),
    ("painting", lambda s: s.painting("new", "torus", NOWHERE, HERE, 1.0 + 0j)),
    ("paint_region", lambda s: s.paint_region("new", {})),
    ("paint_region", lambda s: s.paint_region("new", {"torus": NOWHERE}, axes={"torus": HERE})),
    (
        "paint_region",
        lambda s: s.paint_region("all", {k: s.points(v) for k, v in (("torus", "palm"), ("sphere", "copy"))}),
    ),
    ("erase", lambda s: s.erase("palm")),
    ("erase", lambda s: s.erase("palm", [])),
    ("erase", lambda s: s.erase("palm", [0.5])),
    ("erase", lambda s: s.erase("palm", [-1])),
    ("erase", lambda s: s.erase("palm", [25])),
    ("erase", lambda s: s.erase("palm", range(25))),
    ("erase", lambda s: s.erase("palm", np.ones(25, bool))),
    ("erase", lambda s: s.erase("palm", ["a"])),
    ("erase", lambda s: s.erase("palm", [2**70])),
    ("erase", lambda s: s.erase("palm", near=NOWHERE, radius=1.0)),
    ("erase", lambda s: s.erase("palm", near=NONE, radius=1.0)),
    ("erase", lambda s: s.erase("palm", near=s.points("palm"), radius=-1.0)),
    ("erase", lambda s: s.erase("palm", near=s.points("palm"), radius=NAN)),
    ("merge", lambda s: s.merge("palm", [])),
    ("merge", lambda s: s.merge("palm", ["palm"])),
    ("merge", lambda s: s.merge("palm", ["thumb", "thumb"])),
    ("merge", lambda s: s.merge("palm", ["copy"])),
    ("split", lambda s: s.split("palm", [], "part")),
    ("split", lambda s: s.split("palm", [25], "part")),
    ("split", lambda s: s.split("palm", range(25), "part")),
    ("split", lambda s: s.split("palm", [1], "thumb")),
    ("remove", lambda s: s.remove("palm", "nobody")),
    ("set_axis", lambda s: s.set_axis("palm")),
    ("set_axis", lambda s: s.set_axis("palm", NONE)),
    ("set_axis", lambda s: s.set_axis("palm", NOWHERE, heading=1.0)),
    ("bind", lambda s: s.bind("palm", [25], 0)),
    ("bind", lambda s: s.bind("palm", [0], -1)),
    ("bind", lambda s: s.bind("palm", [0], 2**70)),
    ("weigh", lambda s: s.weigh("palm", "heavy")),
    ("weigh", lambda s: s.weigh("palm", [1.0])),
    ("weigh", lambda s: s.weigh("palm", np.full(25, NAN))),
    ("detach", lambda s: s.detach("nobody")),
    ("translate", lambda s: s.translate("palm", NOWHERE)),
    ("translate", lambda s: s.translate("palm", s.points("palm"))),
    ("place", lambda s: s.place("palm", HERE)),
    ("place", lambda s: s.place("palm", HERE, direction=[1.0, 2.0])),
    ("place", lambda s: s.place("palm", HERE, direction=[NAN] * 3)),
    ("place", lambda s: s.place("palm", NOWHERE, heading=1.0)),
    ("rotate", lambda s: s.rotate("palm", NAN)),
    ("rotate", lambda s: s.rotate("palm", 0.1, about=10**6)),
    ("rotate", lambda s: s.rotate("palm", 0.1, about=-1)),
    ("bend", lambda s: s.bend("palm", 0, 0.1)),
    ("bend", lambda s: s.bend("palm", 1, NAN)),
    ("scale", lambda s: s.scale("palm", along=0.0)),
    ("scale", lambda s: s.scale("palm", spread=-1.0)),
    ("scale", lambda s: s.scale("palm", spread=float("inf"))),
    ("scale", lambda s: s.scale("palm", spread=1e300)),
    ("scale", lambda s: s.scale("palm", along=1e9)),
    ("mirror", lambda s: s.mirror("nobody")),
    ("transfer", lambda s: s.transfer("palm", "sphere", NOWHERE, heading=1.0)),
    ("transfer", lambda s: s.transfer("palm", "moon", HERE, heading=1.0)),
    ("transfer", lambda s: s.transfer("palm", "sphere", HERE, heading=1.0, name="thumb")),
    ("transfer", lambda s: s.transfer("palm", "sphere", HERE, heading=1.0, direction=[1.0, 0.0, 0.0])),
    ("transfer_tree", lambda s: s.transfer_tree("tip", "sphere", HERE, heading=1.0, names={"tip": "palm"})),
    ("symmetric_copy", lambda s: s.symmetric_copy("palm", normal=[0.0, 0.0, 0.0])),
    ("symmetric_copy", lambda s: s.symmetric_copy("palm", normal=[1.0, 0.0])),
    ("link", lambda s: s.link("palm", "palm")),
    ("link", lambda s: s.link("copy", "palm")),
    ("link", lambda s: s.link("tip", "palm", parent_point=10**6)),
    ("link", lambda s: s.link("tip", "palm", own_point=-1)),
    ("unlink", lambda s: s.unlink("palm")),
    ("pair", lambda s: s.pair("palm", "palm")),
    ("pair", lambda s: s.pair("palm", "copy", weight=-1.0)),
    ("pair", lambda s: s.pair("palm", "copy", name=" ")),
    ("unpair", lambda s: s.unpair("nothing")),
    ("pair_geometry", lambda s: s.pair_geometry("nothing")),
    ("group", lambda s: s.group("new", [])),
    ("group", lambda s: s.group("new", ["palm", "palm"])),
    ("ungroup", lambda s: s.ungroup("nothing")),
    ("rename", lambda s: s.rename("palm", "thumb")),
    ("rename", lambda s: s.rename("palm", "\x1b[2J")),
    ("recolor", lambda s: s.recolor("palm", (0.0, 0.0, 2.0))),
    ("recolor", lambda s: s.recolor("palm", None)),  # type: ignore[arg-type]
    ("place_surface", lambda s: s.place_surface("torus", np.diag([2.0, 2.0, 2.0, 1.0]))),
    ("place_surface", lambda s: s.place_surface("torus", np.diag([1.0, 1.0, -1.0, 1.0]))),
    ("place_surface", lambda s: s.place_surface("torus", np.diag([1e300, 1.0, 1.0, 1.0]))),
    ("place_surface", lambda s: s.place_surface("torus", np.eye(4) + np.eye(4, k=-1))),
    ("place_surface", lambda s: s.place_surface("torus", np.vstack([np.eye(4)[:3], np.ones(4)]))),
    ("place_surface", lambda s: s.place_surface("torus", np.eye(3))),
    ("set_pose", lambda s: s.set_pose("torus", Pose(("a",), np.eye(4)[None]))),
    ("clear_pose", lambda s: s.clear_pose("torus")),
    ("set_extra", lambda s: s.set_extra("host", NAN)),
    ("set_extra", lambda s: s.set_extra("host", object())),
    ("set_extra", lambda s: s.set_extra("host", 1 << 64)),
    ("set_extra", lambda s: s.set_extra("host", nested(101))),
    ("set_extra", lambda s: s.set_extra("host", nested(5000))),
    ("set_extra", lambda s: s.set_extra("", 1)),
    ("area", lambda s: s.area("nobody")),
    ("distortion", lambda s: s.distortion("palm", "thumb")),
    ("touching", lambda s: s.touching("torus", "sphere", NAN)),
    ("paint_touching", lambda s: s.paint_touching("new", "torus", "sphere", 1e-9)),
    ("transfer_group", lambda s: s.transfer_group("nothing", ["sphere"], HERE, heading=1.0)),
    ("transfer_group", lambda s: s.transfer_group("all", [], HERE, heading=1.0)),
    ("brush", lambda s: s.brush("nothing", "palm")),
    ("contact_set", lambda s: s.contact_set("set", ["nobody"])),
    ("export_set", lambda s: s.export_set(NO_FOLDER, "set")),
    ("import_set", lambda s: s.import_set(NO_FOLDER)),
    ("import_set", lambda s: s.import_set(s.contact_set("set"), roots={"palm": Root(10**6, (1.0, 0.0, 0.0), 1j)})),
    ("add_surface", lambda s: s.add_surface("torus", cached_family("plane"))),
    ("add_surface", lambda s: s.add_surface("new", cached_family("plane"), meters_per_unit=0.0)),
    ("add_surface", lambda s: s.add_surface("", cached_family("plane"))),
    ("rebind", lambda s: s.rebind("moon", cached_family("plane"))),
    ("rebind", lambda s: s.rebind("torus", cached_family("plane"), old_mesh=cached_family("sphere"))),
    ("macro", lambda s: s.do(Macro("half", (s.painting("a", "torus", HERE, HERE, 1j),) * 2))),
]
ANSWERS = {"named_brush", "default_axis", "mesh", "mesh_of", "axis", "root", "reconstruction", "points", "root_at",
           "relinked", "placement_at", "axis_from", "measured", "check_points", "check_axis_point", "point_indices",
           "pairs", "posed_mesh", "axis_request", "submit"}  # fmt: skip  # they change nothing


@pytest.fixture
def arranged(session: Session) -> Session:
    """Every kind of thing that can be refused: links, copies, groups, pairs."""
    session.link("tip", "thumb")
    session.transfer("palm", "sphere", HERE, heading=1.0, name="copy")
    session.group("all", ["palm", "tip"])
    return session


@pytest.mark.parametrize(("verb", "act"), CASES, ids=[f"{k}-{verb}" for k, (verb, _) in enumerate(CASES)])
def test_it_is_refused_in_a_sentence_and_nothing_has_changed(
    arranged: Session, verb: str, act: Callable[[Session], object]
) -> None:
    before, revision, steps = arranged.document, arranged.revision, arranged.history.steps
    with pytest.raises(ContactError) as refused:
        act(arranged)
    assert len(str(refused.value).split()) >= 4 and len(str(refused.value)) < 500, str(refused.value)
    assert arranged.document is before and arranged.revision == revision
    assert arranged.history.steps == steps
    with pytest.raises(ContactError), arranged.macro("Arrange"):
        act(arranged)
    assert arranged.document is before and arranged.history.steps == steps


def test_no_verb_escapes() -> None:
    public = {
        name
        for kind in (Verbs, SurfaceVerbs)
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        if not name.startswith("_")
    }
    assert public == {verb for verb, _ in CASES} - {"macro"} | ANSWERS
