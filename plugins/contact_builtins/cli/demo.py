"""`contact demo [NAME] --out DIR`: a recipe that comes with the package, on its own samples."""

from __future__ import annotations

import argparse
from pathlib import Path


class Demo:
    name = "demo"
    summary = "pose a built-in hand on a built-in object (without a name: the human hand on the mug)"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("demo", nargs="?", metavar="NAME", help="which one; --list names them")
        parser.add_argument(
            "--out", type=Path, metavar="DIR", help="the folder for the results (contact-demo/NAME)"
        )
        parser.add_argument("--list", action="store_true", help="name the demos and stop")

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_builtins.demos import DEFAULT, demo_names, demo_recipe, run_demo
        from contact_core.cli.pose import tell
        from contact_core.plugins.registry import CLI

        if arguments.list:
            titles = {name: demo_recipe(name).title for name in demo_names()}
            arguments.output.answer(titles, "\n".join(f"{name:<12} {title}" for name, title in titles.items()))
            return 0
        name = DEFAULT if arguments.demo is None else arguments.demo
        out = arguments.out or Path("contact-demo") / name
        result = run_demo(name, out, plugins=arguments.plugins, progress=arguments.output)
        tell(result, arguments.output)
        if "view" in arguments.plugins.offers(CLI):
            arguments.output.remark(f"Open it with: contact view {result.files['scene']}")
        return 0
