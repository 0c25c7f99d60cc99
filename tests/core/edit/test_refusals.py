"""What a verb cannot do it refuses in a sentence, and leaves the document as it was."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.contact.placement import Root
from contact_core.edit.commands import Macro
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.verbs import ContactSets, Pairs, Patches, Surfaces
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
    ("patches.paint", lambda s: s.patches.paint("new", NONE, surface="torus", axis=HERE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("new", NOWHERE, surface="torus", axis=HERE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="torus", axis=NOWHERE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="torus", axis=NONE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="torus", axis=HERE)),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="torus", axis=HERE, heading=complex(NAN))),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="moon", axis=HERE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, color="red")),  # type: ignore[arg-type]
    (
        "patches.paint",
        lambda s: s.patches.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, strength=[1.0, 2.0]),
    ),
    (
        "patches.paint",
        lambda s: s.patches.paint("new", HERE, surface="torus", axis=HERE, heading=1.0, strength=[-1.0]),
    ),
    ("patches.paint", lambda s: s.patches.paint("new\n", HERE, surface="torus", axis=HERE, heading=1.0)),
    ("patches.paint", lambda s: s.patches.paint("palm", BEFORE_ALL)),
    ("patches.paint", lambda s: s.patches._painting("new", "torus", NOWHERE, HERE, 1.0 + 0j)),
    ("patches.paint_region", lambda s: s.patches.paint_region("new", {})),
    ("patches.paint_region", lambda s: s.patches.paint_region("new", {"torus": NOWHERE}, axes={"torus": HERE})),
    (
        "patches.paint_region",
        lambda s: s.patches.paint_region(
            "all", {k: s.geometry.points(v) for k, v in (("torus", "palm"), ("sphere", "copy"))}
        ),
    ),
    ("patches.erase", lambda s: s.patches.erase("palm")),
    ("patches.erase", lambda s: s.patches.erase("palm", [])),
    ("patches.erase", lambda s: s.patches.erase("palm", [0.5])),
    ("patches.erase", lambda s: s.patches.erase("palm", [-1])),
    ("patches.erase", lambda s: s.patches.erase("palm", [25])),
    ("patches.erase", lambda s: s.patches.erase("palm", range(25))),
    ("patches.erase", lambda s: s.patches.erase("palm", np.ones(25, bool))),
    ("patches.erase", lambda s: s.patches.erase("palm", ["a"])),
    ("patches.erase", lambda s: s.patches.erase("palm", [2**70])),
    ("patches.erase", lambda s: s.patches.erase("palm", near=NOWHERE, radius=1.0)),
    ("patches.erase", lambda s: s.patches.erase("palm", near=NONE, radius=1.0)),
    ("patches.erase", lambda s: s.patches.erase("palm", near=s.geometry.points("palm"), radius=-1.0)),
    ("patches.erase", lambda s: s.patches.erase("palm", near=s.geometry.points("palm"), radius=NAN)),
    ("patches.merge", lambda s: s.patches.merge("palm", [])),
    ("patches.merge", lambda s: s.patches.merge("palm", ["palm"])),
    ("patches.merge", lambda s: s.patches.merge("palm", ["thumb", "thumb"])),
    ("patches.merge", lambda s: s.patches.merge("palm", ["copy"])),
    ("patches.split", lambda s: s.patches.split("palm", [], "part")),
    ("patches.split", lambda s: s.patches.split("palm", [25], "part")),
    ("patches.split", lambda s: s.patches.split("palm", range(25), "part")),
    ("patches.split", lambda s: s.patches.split("palm", [1], "thumb")),
    ("patches.remove", lambda s: s.patches.remove("palm", "nobody")),
    ("patches.set_axis", lambda s: s.patches.set_axis("palm")),
    ("patches.set_axis", lambda s: s.patches.set_axis("palm", NONE)),
    ("patches.set_axis", lambda s: s.patches.set_axis("palm", NOWHERE, heading=1.0)),
    ("patches.bind", lambda s: s.patches.bind("palm", [25], 0)),
    ("patches.bind", lambda s: s.patches.bind("palm", [0], -1)),
    ("patches.bind", lambda s: s.patches.bind("palm", [0], 2**70)),
    ("patches.weigh", lambda s: s.patches.weigh("palm", "heavy")),
    ("patches.weigh", lambda s: s.patches.weigh("palm", [1.0])),
    ("patches.weigh", lambda s: s.patches.weigh("palm", np.full(25, NAN))),
    ("patches.detach", lambda s: s.patches.detach("nobody")),
    ("patches.translate", lambda s: s.patches.translate("palm", NOWHERE)),
    ("patches.translate", lambda s: s.patches.translate("palm", s.geometry.points("palm"))),
    ("patches.place", lambda s: s.patches.place("palm", HERE)),
    ("patches.place", lambda s: s.patches.place("palm", HERE, direction=[1.0, 2.0])),
    ("patches.place", lambda s: s.patches.place("palm", HERE, direction=[NAN] * 3)),
    ("patches.place", lambda s: s.patches.place("palm", NOWHERE, heading=1.0)),
    ("patches.put", lambda s: s.patches.put("nobody", s.geometry.root("palm"))),
    ("patches.put", lambda s: s.patches.put("palm", replace(s.geometry.root("palm"), face=10**6))),
    ("patches.rotate", lambda s: s.patches.rotate("palm", NAN)),
    ("patches.rotate", lambda s: s.patches.rotate("palm", 0.1, about=10**6)),
    ("patches.rotate", lambda s: s.patches.rotate("palm", 0.1, about=-1)),
    ("patches.bend", lambda s: s.patches.bend("palm", 0, 0.1)),
    ("patches.bend", lambda s: s.patches.bend("palm", 1, NAN)),
    ("patches.scale", lambda s: s.patches.scale("palm", along=0.0)),
    ("patches.scale", lambda s: s.patches.scale("palm", spread=-1.0)),
    ("patches.scale", lambda s: s.patches.scale("palm", spread=float("inf"))),
    ("patches.scale", lambda s: s.patches.scale("palm", spread=1e300)),
    ("patches.scale", lambda s: s.patches.scale("palm", along=1e9)),
    ("patches.mirror", lambda s: s.patches.mirror("nobody")),
    ("patches.transfer", lambda s: s.patches.transfer("palm", "sphere", NOWHERE, heading=1.0)),
    ("patches.transfer", lambda s: s.patches.transfer("palm", "moon", HERE, heading=1.0)),
    ("patches.transfer", lambda s: s.patches.transfer("palm", "sphere", HERE, heading=1.0, name="thumb")),
    (
        "patches.transfer",
        lambda s: s.patches.transfer("palm", "sphere", HERE, heading=1.0, direction=[1.0, 0.0, 0.0]),
    ),
    (
        "patches.transfer_tree",
        lambda s: s.patches.transfer_tree("tip", "sphere", HERE, heading=1.0, names={"tip": "palm"}),
    ),
    ("patches.symmetric_copy", lambda s: s.patches.symmetric_copy("palm", normal=[0.0, 0.0, 0.0])),
    ("patches.symmetric_copy", lambda s: s.patches.symmetric_copy("palm", normal=[1.0, 0.0])),
    ("patches.link", lambda s: s.patches.link("palm", "palm")),
    ("patches.link", lambda s: s.patches.link("copy", "palm")),
    ("patches.link", lambda s: s.patches.link("tip", "palm", parent_point=10**6)),
    ("patches.link", lambda s: s.patches.link("tip", "palm", own_point=-1)),
    ("patches.unlink", lambda s: s.patches.unlink("palm")),
    ("pairs.add", lambda s: s.pairs.add("palm", "palm")),
    ("pairs.add", lambda s: s.pairs.add("palm", "copy", weight=-1.0)),
    ("pairs.add", lambda s: s.pairs.add("palm", "copy", name=" ")),
    ("pairs.remove", lambda s: s.pairs.remove("nothing")),
    ("geometry.pair", lambda s: s.geometry.pair("nothing")),
    ("patches.group", lambda s: s.patches.group("new", [])),
    ("patches.group", lambda s: s.patches.group("new", ["palm", "palm"])),
    ("patches.ungroup", lambda s: s.patches.ungroup("nothing")),
    ("patches.rename", lambda s: s.patches.rename("palm", "thumb")),
    ("patches.rename", lambda s: s.patches.rename("palm", "\x1b[2J")),
    ("patches.recolor", lambda s: s.patches.recolor("palm", (0.0, 0.0, 2.0))),
    ("patches.recolor", lambda s: s.patches.recolor("palm", None)),  # type: ignore[arg-type]
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.diag([2.0, 2.0, 2.0, 1.0]))),
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.diag([1.0, 1.0, -1.0, 1.0]))),
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.diag([1e300, 1.0, 1.0, 1.0]))),
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.eye(4) + np.eye(4, k=-1))),
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.vstack([np.eye(4)[:3], np.ones(4)]))),
    ("surfaces.place", lambda s: s.surfaces.place("torus", np.eye(3))),
    ("surfaces.set_pose", lambda s: s.surfaces.set_pose("torus", Pose(("a",), np.eye(4)[None]))),
    ("surfaces.clear_pose", lambda s: s.surfaces.clear_pose("torus")),
    ("set_extra", lambda s: s.set_extra("host", NAN)),
    ("set_extra", lambda s: s.set_extra("host", object())),
    ("set_extra", lambda s: s.set_extra("host", 1 << 64)),
    ("set_extra", lambda s: s.set_extra("host", nested(101))),
    ("set_extra", lambda s: s.set_extra("host", nested(5000))),
    ("set_extra", lambda s: s.set_extra("", 1)),
    ("geometry.area", lambda s: s.geometry.area("nobody")),
    ("geometry.distortion", lambda s: s.geometry.distortion("palm", "thumb")),
    ("geometry.crowded", lambda s: s.geometry.crowded(["nobody"])),
    ("geometry.touching", lambda s: s.geometry.touching("torus", "sphere", NAN)),
    ("patches.paint_touching", lambda s: s.patches.paint_touching("new", "torus", "sphere", 1e-9)),
    ("patches.transfer_group", lambda s: s.patches.transfer_group("nothing", ["sphere"], HERE, heading=1.0)),
    ("patches.transfer_group", lambda s: s.patches.transfer_group("all", [], HERE, heading=1.0)),
    ("patches.brush", lambda s: s.patches.brush("nothing", "palm")),
    ("sets.of", lambda s: s.sets.of("set", ["nobody"])),
    ("sets.write", lambda s: s.sets.write(NO_FOLDER, "set")),
    ("sets.read", lambda s: s.sets.read(NO_FOLDER)),
    ("sets.read", lambda s: s.sets.read(s.sets.of("set"), roots={"palm": Root(10**6, (1.0, 0.0, 0.0), 1j)})),
    ("surfaces.add", lambda s: s.surfaces.add("torus", cached_family("plane"))),
    ("surfaces.add", lambda s: s.surfaces.add("new", cached_family("plane"), meters_per_unit=0.0)),
    ("surfaces.add", lambda s: s.surfaces.add("", cached_family("plane"))),
    ("surfaces.rename", lambda s: s.surfaces.rename("torus", "sphere")),
    ("surfaces.rename", lambda s: s.surfaces.rename("moon", "sun")),
    ("surfaces.remove", lambda s: s.surfaces.remove("torus")),
    ("surfaces.remove", lambda s: s.surfaces.remove("moon")),
    ("surfaces.rebind", lambda s: s.surfaces.rebind("moon", cached_family("plane"))),
    (
        "surfaces.rebind",
        lambda s: s.surfaces.rebind("torus", cached_family("plane"), old_mesh=cached_family("sphere")),
    ),
    ("surfaces.add_proxy", lambda s: s.surfaces.add_proxy("moon")),
    ("surfaces.add_proxy", lambda s: s.surfaces.add_proxy("torus", "nothing")),
    ("surfaces.add_proxy", lambda s: s.surfaces.add_proxy("torus", offset=NAN)),
    ("surfaces.add_proxy", lambda s: s.surfaces.add_proxy("torus", mesh=cached_family("plane"))),
    ("surfaces.remove_proxy", lambda s: s.surfaces.remove_proxy("torus")),
    ("surfaces.know_proxy", lambda s: s.surfaces.know_proxy("torus", cached_family("sphere"))),
    ("macro", lambda s: s.do(Macro("half", (s.patches._painting("a", "torus", HERE, HERE, 1j),) * 2))),
]
READING = {
    f"geometry.{name}"
    for name in [
        "of",
        "mesh",
        "mesh_of",
        "surface_from_surface",
        "axis",
        "root",
        "reconstruction",
        "points",
        "root_at",
        "check_points",
        "pairs",
        "posed_mesh",
        "axis_request",
        "carrier",
        "carrier_of",
        "on_carrier",
        "posed_carrier",
        "seen",
        "axis_points",
    ]
}  # it changes nothing


@pytest.fixture
def arranged(session: Session) -> Session:
    """Every kind of thing that can be refused: links, copies, groups, pairs."""
    session.patches.link("tip", "thumb")
    session.patches.transfer("palm", "sphere", HERE, heading=1.0, name="copy")
    session.patches.group("all", ["palm", "tip"])
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
    groups = {
        "patches": Patches, "pairs": Pairs, "surfaces": Surfaces, "sets": ContactSets, "geometry": DocumentGeometry
    }  # fmt: skip
    public = {
        f"{group}.{name}"
        for group, kind in groups.items()
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        if not name.startswith("_")
    }
    assert public == {verb for verb, _ in CASES if "." in verb} | READING
