"""Random reachable poses of six rigs, found again from their own contacts: those of the issue, fifty seeds each."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from harness import record

import contact_builtins
from contact_builtins.samples import catalogue
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.rig.chart import Chart
from contact_core.rig.rig import Rig, skin
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.testing import rigs

MET = 0.01  # of the manipulator's length
CONTACTS, REACH, SPREAD = 300, 3.0, 0.6  # radians of rest
ASSETS = Path(os.environ.get("CONTACT_ASSETS", Path(__file__).resolve().parents[2] / "shared" / "assets")) / "rigs"
BODY, HAND = "makehuman_body_53_joints.glb", "hand_l"
FILES = ("webxr_generic_hand_left.glb", BODY, "allegro_hand_right/allegro_hand_right.urdf")
BUILT_IN = ("HUMAN_HAND", "WITCH_HAND", "ALIEN_HAND", "HUMAN_BODY", "TENTACLE")


def planted_rows(seeds: int) -> list[str]:
    """The section of the page: per rig the share that is met to 1 % of its length, and how far the worst is."""
    lines = [
        f"A random pose within limits and {SPREAD:g} rad of rest, up to {REACH:g} lengths away and turned anyhow,"
        f" and {CONTACTS} contacts on a mold of it: found again from rest by default settings, {seeds} seeds a rig."
        " Met: mean distance of paired points at most 1 % of the manipulator's length. Wanted: 95 %. The hand of a"
        " body moves by its own joints and is measured by its own length.",
        "",
        "| rig | free dofs | met, % | mean distance, median % | worst % |",
        "|---" * 5 + "|",
    ]
    rows = {}
    for name, rig, part in all_rigs():
        problems = [planted_part(rig, part, seed) for seed in range(seeds)]
        gaps = np.array([rigs.mean_gap(p, LevenbergMarquardt().solve(p).theta) for p in problems])
        met, middle, worst = 100.0 * float((gaps <= MET).mean()), 100.0 * np.median(gaps), 100.0 * gaps.max()
        lines.append(f"| {name} | {len(problems[0].start)} | {met:.0f} | {middle:.3f} | {worst:.3f} |")
        rows[name] = f"{met:.0f} %, the worst {worst:.3f} % away"
    record(f"Planted poses found again to 1 % of the length, {seeds} seeds (at least 95 %)", rows)
    return lines


def all_rigs() -> Iterator[tuple[str, Rig, str | None]]:
    """Name, rig, and the joint whose part of it is planted (None: all of it); files only where the assets are."""
    for name in BUILT_IN:
        yield name.lower().replace("_", " "), _built_in(name), None
    formats = PluginManager([contact_builtins], discover=False).offers(FORMATS).values()
    for path in (ASSETS / name for name in FILES):
        if path.exists():
            rig = next(f for f in formats if path.suffix in f.suffixes and f.can_read).read(path).rig
            assert rig is not None
            yield path.name, rig, None
            if path.name == BODY:
                yield f"{path.name}, {HAND} alone", rig, HAND


def _built_in(name: str) -> Rig:
    rig = getattr(catalogue, name).build().rig
    assert isinstance(rig, Rig)
    return rig


def planted_part(rig: Rig, part: str | None, seed: int) -> PoseProblem:
    """A problem whose answer is known: the whole rig, or one joint and all below it while the rest is held."""
    if part is None:
        return rigs.planted(rig, seed, contacts=CONTACTS, reach=REACH)[0]
    chart, random = Chart(rig), np.random.default_rng(seed)
    below = [rig.joint_index(part)]
    for joint, parent in enumerate(rig.parents):  # parents come first
        if parent in below:
            below.append(joint)
    moved = np.isin(chart.joint_of_dof, below) & ~chart.locked & ~chart.is_translation
    theta = random.uniform(np.maximum(chart.lower, -SPREAD), np.minimum(chart.upper, SPREAD)) * moved
    mold = TriangleMesh(skin(rig, chart.motion(theta).world), rig.faces[:, ::-1])
    strongest = rig.skin_joints[np.arange(len(rig.skin_joints)), rig.skin_weights.argmax(axis=1)]  # (n,)
    own = np.flatnonzero(np.isin(strongest[rig.faces], below).all(axis=1))
    faces, shares = random.choice(own, CONTACTS), random.dirichlet(np.ones(3), CONTACTS)
    ends = SurfacePoints(faces, shares), SurfacePoints(faces, shares[:, ::-1])
    pairs = (PairedPoints("all", rig.name, ends[0], "mold", ends[1]),)
    free = {rig.name: [rig.joints[joint] for joint in below]}
    return PoseProblem((Body.skinned(rig), Body.rigid("mold", mold)), pairs, free=free)
