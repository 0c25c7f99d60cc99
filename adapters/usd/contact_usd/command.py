"""`contact usd`: look into stages, write assets to them, bring contacts onto shots, solve and publish them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contact_core.cli.frames import frames_of
from contact_core.errors import InvalidInput
from contact_core.progress import Progress


class UsdCommand:
    name = "usd"
    summary = "inspect USD stages, export assets to them, transfer contacts to shots, solve and publish shots"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
        inspect = actions.add_parser("inspect", help="tell what is in a stage")
        inspect.add_argument("file", type=Path)
        inspect.add_argument(
            "--validate", action="store_true", help="exit with 1 where USD's validators find errors"
        )
        export = actions.add_parser("export", help="write mesh or rig files, or sample:NAME, into a new stage")
        export.add_argument("assets", nargs="+", metavar="ASSET")
        export.add_argument("--out", type=Path, required=True, metavar="FILE.usda")
        transfer = actions.add_parser("transfer", help="bring the contacts of a document or stage onto shots")
        transfer.add_argument("source", type=Path)
        solve = actions.add_parser("solve", help="solve the contact pairs of shots and key the poses")
        solve.add_argument("--frames", type=_frames, metavar="1,5,10-20", help="time codes; without, no key is set")
        solve.add_argument("--solver", metavar="NAME")
        publish = actions.add_parser("publish", help="write contacts as points and curves that every viewer shows")
        publish.add_argument("--frames", type=_frames, metavar="1,5,10-20", help="time codes to key them at")
        for action in (transfer, solve, publish):
            action.add_argument("shots", nargs="+", type=Path, metavar="SHOT")
            action.add_argument(
                "--out", type=Path, metavar="DIR", help="folder for the layers; else beside each shot"
            )
            action.add_argument(
                "--surface",
                action="append",
                default=[],
                type=_binding,
                metavar="NAME=PATH",
                help="the prim of a surface",
            )

    def run(self, arguments: argparse.Namespace) -> int:
        actions: dict[str, Callable[[argparse.Namespace], int]] = {
            "inspect": _inspect,
            "export": _export,
            "transfer": _transfer,
            "solve": _solve,
            "publish": _publish,
        }
        _need_pxr()
        return actions[arguments.action](arguments)


def _need_pxr() -> None:
    import importlib.util

    from contact_core.errors import MissingExtra

    if importlib.util.find_spec("pxr") is None:
        raise MissingExtra("contact usd", "usd")


def _inspect(arguments: argparse.Namespace) -> int:
    from contact_core.document.schema import VERSION
    from contact_usd.host import UsdHost
    from contact_usd.validate import problems

    host = UsdHost(arguments.file)
    space, stored = host.space(), host.stored_document()
    facts: dict[str, Any] = {
        "file": str(arguments.file),
        "meters_per_unit": space.meters_per_unit,
        "up_axis": space.up_axis,
        "time_codes_per_second": space.frames_per_second,
        "objects": [_object_facts(host, item) for item in host.objects()],
        "notes": list(space.notes),
    }
    if stored is not None:
        size = sum(map(len, stored.parts.values()))
        facts["document"] = {"revision": stored.stamp.revision, "schema": stored.stamp.schema, "bytes": size}
        if stored.stamp.schema <= VERSION:
            document = stored.read("the document in the stage").document
            facts["document"] |= {"patches": sorted(document.patches), "pairs": sorted(document.pairs)}
    if arguments.validate:
        facts["problems"] = list(problems(host.stage))
    arguments.output.answer(facts, _inspection_text(facts))
    return int(bool(facts.get("problems")))


def _object_facts(host: Any, item: Any) -> dict[str, Any]:
    facts: dict[str, Any] = {"id": item.id, "kind": item.kind}
    try:
        asset = host.read_surface(item.id)
    except InvalidInput as error:
        return {**facts, "refused": str(error)}
    facts |= {"points": len(asset.mesh.points), "triangles": len(asset.mesh.faces), "notes": list(asset.notes)}
    if asset.rig is not None:
        facts |= {"joints": len(asset.rig.joints), "keys": list(host.pose_keys(item.id))}
    return facts


def _inspection_text(facts: dict[str, Any]) -> str:
    lines = [f"{facts['file']}: {facts['meters_per_unit']:g} m a unit, {facts['up_axis']} up"]
    for item in facts["objects"]:
        if "refused" in item:
            lines.append(f"  {item['kind']} {item['id']}: refused: {item['refused']}")
            continue
        rig = f", {item['joints']} joints, {len(item['keys'])} keys" if "joints" in item else ""
        lines.append(f"  {item['kind']} {item['id']}: {item['points']} points, {item['triangles']} triangles{rig}")
        lines += [f"    - {note}" for note in item["notes"]]
    if "document" in facts:
        document = facts["document"]
        patches = (
            f", {len(document['patches'])} patches, {len(document['pairs'])} pairs" if "patches" in document else ""
        )
        lines.append(f"  document: revision {document['revision']}, schema {document['schema']}{patches}")
    lines += [f"  - {note}" for note in facts["notes"]]
    lines += [f"  ! {problem}" for problem in facts.get("problems", ())]
    return "\n".join(lines)


def _export(arguments: argparse.Namespace) -> int:
    from contact_core.plugins.reading import read_asset
    from contact_core.scene.host import SceneSpace
    from contact_usd.host import UsdHost

    assets = [read_asset(name, arguments.plugins) for name in arguments.assets]
    unit = next((asset.meters_per_unit for asset in assets if asset.meters_per_unit is not None), 1.0)
    host = UsdHost(space=SceneSpace(unit, assets[0].up_axis))
    paths = [host.add(asset) for asset in assets]
    host.save(arguments.out)
    notes = [note for asset in assets for note in asset.notes]
    text = "\n".join([f"wrote {arguments.out}: {', '.join(paths)}", *(f"  - {note}" for note in notes)])
    arguments.output.answer({"file": str(arguments.out), "objects": paths, "notes": notes}, text)
    return 0


def _transfer(arguments: argparse.Namespace) -> int:
    from contact_usd import shots

    document = shots.read_contacts(arguments.source)
    wanted = dict(arguments.surface)
    return _each_shot(arguments, lambda path, out, _: shots.transfer(document, path, wanted, out))


def _solve(arguments: argparse.Namespace) -> int:
    from contact_core.plugins.registry import POSE_SOLVERS
    from contact_usd import shots

    plugins, wanted = arguments.plugins, dict(arguments.surface)
    solver = arguments.solver
    if solver is not None:
        plugins.get(POSE_SOLVERS, solver)  # before the first shot, an unknown name is refused

    def work(path: Path, out: Path | None, part: Progress) -> dict[str, object]:
        return shots.solve(path, arguments.frames, solver, wanted, out, part, plugins)

    return _each_shot(arguments, work)


def _publish(arguments: argparse.Namespace) -> int:
    from contact_usd import shots

    frames, wanted = arguments.frames, dict(arguments.surface)
    return _each_shot(arguments, lambda path, out, _: shots.review(path, frames, wanted, out))


Work = Callable[[Path, Path | None, Progress], dict[str, object]]


def _each_shot(arguments: argparse.Namespace, work: Work) -> int:
    """One bad shot stops no other: it is told, and the exit code is 1."""
    from contact_core.errors import ContactError

    results: list[dict[str, object]] = []
    lines = []
    written: dict[Path, Path] = {}  # the shot behind each place in which layers are written
    for number, path in enumerate(arguments.shots):
        part = arguments.output.part(number / len(arguments.shots), (number + 1) / len(arguments.shots), path.name)
        part.tell(0.0, "")
        name = f"{path.stem.removesuffix('.contact')}.contact.usda"
        out = None if arguments.out is None else arguments.out / name
        try:
            _check_alone(path, written.setdefault((out or path.with_name(name)).absolute(), path), name)
            facts = work(path, out, part)
        except ContactError as error:
            results.append({"shot": str(path), "failed": str(error)})
            lines.append(f"! {path}: {error}")
        else:
            results.append({"shot": str(path), **facts})
            lines.append(f"{path}: {_told(facts)}")
    arguments.output.answer(results, "\n".join(lines))
    return int(any("failed" in result for result in results))


def _check_alone(path: Path, first: Path, name: str) -> None:
    """Shots of one name would write one layer, and only the last would be left."""
    if first is not path:
        raise InvalidInput(f"{first} and this shot both write {name} there; give each an --out folder of its own.")


def _told(facts: dict[str, Any]) -> str:
    if "patches" in facts:
        return f"{len(facts['patches'])} patches on {', '.join(facts['surfaces'].values())}"
    return ", ".join(
        ("pose" if item["frame"] is None else f"frame {item['frame']:g}") + f" {item['status'].lower()}"
        for item in facts["frames"]
    )


def _frames(text: str) -> tuple[float, ...]:
    try:
        return frames_of(text)
    except InvalidInput as error:
        raise argparse.ArgumentTypeError(str(error).rstrip(".")) from error


def _binding(text: str) -> tuple[str, str]:
    name, equals, path = text.partition("=")
    if not (name and equals and path.startswith("/")):
        raise argparse.ArgumentTypeError(f"wanted is NAME=/prim/path, but got {text!r}")
    return name, path
