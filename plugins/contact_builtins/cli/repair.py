"""`contact repair FILE`: the closed manifold that contacts on a broken surface run on."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contact_core.document.asset import Asset
    from contact_core.geometry.mesh import TriangleMesh


class Repair:
    name = "repair"
    summary = "make the closed manifold that stands for a broken mesh, its proxy"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", type=Path, metavar="FILE", help="a mesh or rig, or sample:NAME")
        parser.add_argument("--out", type=Path, metavar="OUT.glb", help="write it there, with the skeleton of FILE")
        parser.add_argument("--picture", type=Path, metavar="OUT.png", help="draw it beside FILE there")
        parser.add_argument("--maker", help="the proxy maker; by default the one for repairs")
        parser.add_argument(
            "--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the maker: offset=0.005"
        )

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.cli.samples import writer_of
        from contact_core.errors import InvalidInput
        from contact_core.plugins.proxies import made_proxy
        from contact_core.plugins.reading import read_asset

        if arguments.out is None and arguments.picture is None:
            raise InvalidInput("where to? Add --out FILE.glb, or --picture FILE.png to see it first.")
        writer = None if arguments.out is None else writer_of(arguments.plugins, arguments.out)
        asset = read_asset(arguments.file, arguments.plugins)
        settings = _settings(arguments)
        record, proxy = made_proxy(asset.mesh, arguments.plugins, arguments.maker, settings, arguments.output)
        facts: dict[str, Any] = {
            "file": str(arguments.file),
            "maker": record.maker,
            "settings": dict(record.settings),
        }
        facts |= {"before": _facts(asset.mesh), "after": _facts(proxy), **_distances(asset.mesh, proxy)}
        if arguments.picture is not None:
            from contact_builtins.cli.proxy_picture import proxy_pictures
            from contact_core.plugins.drawing import draw

            pictures = proxy_pictures(asset.mesh, proxy, asset.up_axis)
            draw(pictures, arguments.picture, arguments.plugins, size=(1600, 800))
            facts["picture"] = str(arguments.picture)
        if writer is not None:
            writer.write(arguments.out, [_skinned(asset, proxy)], {})
            facts["written"] = str(arguments.out)
        arguments.output.answer(facts, _text(facts))
        return 0


def _settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """What --set says, by name. Raises InvalidInput."""
    from contact_core.errors import InvalidInput
    from contact_core.plugins.registry import PROXY_MAKERS

    plugins = arguments.plugins
    name = plugins.name_for(PROXY_MAKERS, "repair", arguments.maker)
    kinds = {each.name: each.kind for each in plugins.settings_of(PROXY_MAKERS, name)}
    found: dict[str, Any] = {}
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            raise InvalidInput(f"a setting is spelt NAME=VALUE, but got {text!r}.")
        found[key] = _value(value, kinds.get(key, "text"))
    return found


def _value(text: str, kind: str) -> Any:
    """A word of the command line as a setting of a kind takes it; what is none is left for it to refuse."""
    if kind == "flag":
        return {"true": True, "yes": True, "false": False, "no": False}.get(text.lower(), text)
    if kind in ("number", "count"):
        try:
            return float(text) if kind == "number" else int(text)
        except ValueError:
            return None if text.lower() == "none" else text
    return text


def _skinned(asset: Asset, proxy: TriangleMesh) -> Asset:
    """The proxy as an asset, on the skeleton of the asset that it stands for."""
    from contact_core.rig.carried import carried

    rig = None if asset.rig is None else carried(asset.rig, proxy)
    return replace(
        asset, name=f"{asset.name}_proxy", mesh=proxy, rig=rig, source_vertices=None, source_faces=None, notes=()
    )


def _facts(mesh: TriangleMesh) -> dict[str, Any]:
    from contact_core.geometry.report import report

    found = report(mesh)
    return {
        "faces": found.faces,
        "components": found.components,
        "boundary_loops": found.boundary_loops,
        "non_manifold_edges": len(found.non_manifold_edges),
        "non_manifold_vertices": len(found.non_manifold_vertices),
    }


def _distances(mesh: TriangleMesh, proxy: TriangleMesh) -> dict[str, float]:
    """How far apart the two are, in shares of the mesh's diagonal."""
    from contact_core.geometry.raycast import Locator

    away = Locator.of(mesh).closest(proxy.points).distance / mesh.bounding_box_diagonal
    return {"mean_distance": float(away.mean()), "largest_distance": float(away.max())}


def _text(facts: dict[str, Any]) -> str:
    def line(label: str, found: dict[str, Any]) -> str:
        return f"  {label}: " + ", ".join(f"{number} {kind.replace('_', ' ')}" for kind, number in found.items())

    chosen = ", ".join(f"{key} {value}" for key, value in facts["settings"].items() if value is not None)
    lines = [
        f"{facts['file']}: a proxy by {facts['maker']} ({chosen})",
        line("before", facts["before"]),
        line("after", facts["after"]),
        f"  it lies {facts['mean_distance']:.2%} of the diagonal away, {facts['largest_distance']:.2%} at most",
    ]
    lines += [f"  {key}: {facts[key]}" for key in ("written", "picture") if key in facts]
    return "\n".join(lines)
