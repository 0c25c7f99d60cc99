"""`contact inspect FILE`: what is in a file, and whether and how it can be posed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


class Inspect:
    name = "inspect"
    summary = "tell what is in a mesh or rig file"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", type=Path, metavar="FILE", help="a mesh or rig, or sample:NAME")
        parser.add_argument("--sidecar", type=Path, metavar="RIG.toml", help="joint limits and hinges for the rig")
        parser.add_argument(
            "--picture", type=Path, metavar="FILE.png", help="draw the description of its hand there"
        )

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_builtins.formats.inspection import inspect_asset
        from contact_core.plugins.reading import read_asset

        asset = read_asset(arguments.file, arguments.plugins, sidecar=arguments.sidecar)
        if arguments.picture is not None:
            _draw(asset, arguments)
        facts = {"file": str(arguments.file), **inspect_asset(asset)}
        arguments.output.answer(facts, _text(facts))
        return 0


def _draw(asset: Any, arguments: argparse.Namespace) -> None:
    """The hand's picture by the first renderer that can draw. Raises InvalidInput without a hand or renderer."""
    from contact_builtins.cli.hand_picture import hand_pictures
    from contact_core.plugins.drawing import draw

    draw(hand_pictures(asset), arguments.picture, arguments.plugins, size=(1600, 800))


def _hand_lines(hand: dict[str, Any]) -> list[str]:
    """A hand in lines: palm, digits from the thumb on, pads."""
    palm = hand["palm"]
    normal, fingers = (" ".join(f"{value:.2f}" for value in palm[key]) for key in ("normal", "fingers"))
    kind = f"{hand['side'] or 'side unknown'} hand" if palm["is_plane"] else "claw"
    lines = [
        f"  {kind} at {hand['hub']} (confidence {hand['confidence']:.2f}):"
        + (f" palm normal {normal}, fingers {fingers}" if palm["is_plane"] else f" axis {normal}")
    ]
    for digit in hand["digits"]:
        joints = [bone["joint"] + ("" if bone["flexes"] else " (does not flex)") for bone in digit["bones"]]
        joints += [f"{digit['tip_joint']} (tip)"] if digit["tip_joint"] else []
        lines.append(f"    {digit['role']}: {', '.join(joints)}")
    lines.append(f"    {_count(len(hand['pads']), 'pad')}: {', '.join(pad['name'] for pad in hand['pads'])}")
    return lines + [f"    - {note}" for note in hand["notes"]]


def _text(facts: dict[str, Any]) -> str:
    """The same facts in lines."""
    mesh, rig, unit = facts["mesh"], facts["rig"], facts["meters_per_unit"]
    extent = " x ".join(f"{side:.4g}" for side in mesh["extent"])
    lines = [
        f"{facts['name']}: {facts['kind']}",
        f"  {_count(mesh['vertices'], 'vertex', 'vertices')}, {_count(mesh['faces'], 'face')},"
        f" {_count(mesh['components'], 'component')}, genus {'?' if mesh['genus'] is None else mesh['genus']}",
        f"  {extent} units, "
        + ("the format does not say how long a unit is" if unit is None else f"{unit} m each"),
        f"  {'watertight' if mesh['watertight'] else 'open'}, {_count(mesh['boundary_loops'], 'boundary loop')},"
        f" {_count(mesh['non_manifold_edges'], 'non-manifold edge')},"
        f" {_count(mesh['degenerate_faces'], 'degenerate face')},"
        f" {_count(mesh['unused_vertices'], 'unused vertex', 'unused vertices')}",
    ]
    if rig is not None:
        weights = "weights sum to 1" if rig["weights_sum_to_1"] else "weights did not sum to 1"
        lines += [
            f"  {_count(rig['joints'], 'joint')}, {_count(rig['degrees_of_freedom'], 'degree')} of freedom,"
            f" {_count(rig['influences'], 'influence')} a vertex, {weights}",
            f"  the rest pose is {'' if rig['rest_is_bind'] else 'not '}the bind pose",
        ]
    for hand in facts["hands"]:
        lines += _hand_lines(hand)
    return "\n".join(lines + [f"  - {note}" for note in facts["notes"]])


def _count(number: int, noun: str, plural: str = "") -> str:
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
