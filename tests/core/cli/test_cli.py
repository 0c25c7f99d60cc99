"""The command line: fast and light, errors in one sentence, JSON when asked, plugins' sub-commands."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType

import pytest

from contact_core.cli import main
from contact_core.cli.output import columns
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager
from contact_core.session import Session
from contact_core.testing import meshes

HEAVY = ("numba", "numpy", "scipy", "trimesh", "pyvista", "vtk", "pxr", "bpy", "nlopt", "rich")


@pytest.mark.parametrize("arguments", [["--help"], ["pose", "--help"], ["inspect", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    """The cost of `--help` is guarded by counting modules: it answers in a tenth of a second because there are
    few."""
    script = (
        "import sys\nfrom contact_core.cli import main\n"
        f"try: main({arguments!r})\nexcept SystemExit as end: assert not end.code\n"
        "heavy = [name for name in sys.modules if name.partition('.')[0] in sys.argv]\n"
        "print(len(sys.modules), heavy, file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", script, *HEAVY], capture_output=True, text=True, check=True)
    count, heavy = run.stderr.strip().splitlines()[-1].split(" ", 1)
    assert heavy == "[]"
    assert int(count) < 400, count


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    text = capsys.readouterr().out
    for name in (
        "pose",
        "inspect",
        "samples",
        "history",
        "replay",
        "diff",
        "accept",
        "plugins",
        "new-plugin",
        "warm-up",
    ):
        assert f"\n    {name} " in text or f"\n    {name}\n" in text, name


class Shout:
    """A sub-command of a plugin."""

    name = "shout"
    summary = "say a word loudly"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument("word")

    def run(self, arguments: argparse.Namespace) -> int:
        if not arguments.word:
            raise InvalidInput("expected a word, but got none.")
        if arguments.word == "stop":
            raise KeyboardInterrupt
        if arguments.word == "disk":
            raise OSError(28, "No space left on device", "out.json")
        arguments.output.remark("shouting")
        arguments.output.answer({"word": arguments.word}, arguments.word.upper())
        return 0


@pytest.fixture
def shouting() -> PluginManager:
    module = ModuleType("shouting")
    module.contact_cli = hookimpl(lambda: [Shout])  # type: ignore[attr-defined]
    return PluginManager([module], discover=False)


def test_a_plugin_brings_a_sub_command(shouting: PluginManager, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shout", "hello"], plugins=shouting) == 0
    assert capsys.readouterr() == ("HELLO\n", "shouting\n")
    assert main(["shout", "hello", "--json", "--quiet"], plugins=shouting) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == {"word": "hello"} and err == ""


def commanding(name: str, summary: str = "says nothing", error: Exception | None = None) -> PluginManager:
    """A plugin with one sub-command, which prints at every chance, and `shout` beside it."""

    class Chatty(Shout):
        def configure(self, parser: argparse.ArgumentParser) -> None:
            print("setting up")  # noqa: T201
            if error is not None:
                raise error
            super().configure(parser)

    Chatty.name, Chatty.summary = name, summary

    def contact_cli() -> list[type]:
        print("offering")  # noqa: T201
        return [Chatty]

    chatty, shouting = ModuleType("chatty"), ModuleType("shouting")
    chatty.contact_cli = hookimpl(contact_cli)  # type: ignore[attr-defined]
    shouting.contact_cli = hookimpl(lambda: [Shout])  # type: ignore[attr-defined]
    return PluginManager([chatty, shouting], discover=False)


@pytest.mark.parametrize(
    ("name", "error", "reason"),
    [
        ("broken", ValueError("no such option"), "cannot be set up: ValueError: no such option"),
        ("plugins", None, "contact has a sub-command of that name itself"),
        ("--help me", None, "nobody could type it"),
    ],
)
def test_an_unsound_sub_command_is_left_out_and_named(
    name: str, error: Exception | None, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plugins = commanding(name, error=error)
    assert main(["shout", "on"], plugins=plugins) == 0
    assert capsys.readouterr().out.endswith("ON\n")
    assert main(["plugins", "--check"], plugins=plugins) == 1
    told = capsys.readouterr().out
    assert f"its sub-command {name!r} is refused" in told and reason in told
    assert "sub-command: shout" in told and f"sub-command: {name}" not in told


def test_a_summary_may_hold_a_percent_sign(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"], plugins=commanding("all", "100% (of it)"))
    assert end.value.code == 0 and "100% (of it)" in capsys.readouterr().out


def test_what_plugins_print_is_no_part_of_a_json_answer(capsys: pytest.CaptureFixture[str]) -> None:
    plugins = commanding("all")
    capsys.readouterr()
    assert main(["all", "word", "--json"], plugins=plugins) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == {"word": "word"} and "setting up" in err


def test_what_would_steer_a_terminal_is_spelt_out(capsys: pytest.CaptureFixture[str]) -> None:
    module = ModuleType("red\x1b[31m")
    module.contact_cli = hookimpl(lambda: [Shout])  # type: ignore[attr-defined]
    assert main(["plugins"], plugins=PluginManager([module], discover=False)) == 0
    assert "red\\x1b[31m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("word", "code", "sentence"),
    [
        ("", 2, "contact: expected a word, but got none.\n"),
        ("stop", 130, "contact: interrupted.\n"),
        ("disk", 2, "contact: out.json: No space left on device.\n"),
    ],
)
def test_an_error_is_one_sentence(
    word: str, code: int, sentence: str, shouting: PluginManager, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["shout", word], plugins=shouting) == code
    assert capsys.readouterr() == ("", sentence)


def test_an_unknown_command_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["paint"])
    assert end.value.code == 2 and "invalid choice: 'paint'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["inspect", "no_such.obj"],
        ["inspect", "folder.xyz"],
        ["pose", "no_such.toml", "--out", "out"],
        ["history", "no_such.json"],
        ["replay", "no_such.journal"],
        ["diff", "no_such.json", "neither.json"],
        ["samples", "no_such_hand", "--out", "hand.glb"],
        ["new-plugin", "1bad"],
        ["new-plugin", "import"],
    ],
)
def test_bad_input_ends_with_2_and_leaves_nothing(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("contact: ") and err.count("\n") == 1 and len(err.split()) >= 5
    assert not list(tmp_path.iterdir())


def test_inspect_tells_what_is_in_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "square.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", encoding="utf-8")
    assert main(["inspect", str(file), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["mesh"]["faces"] == 2 and facts["mesh"]["boundary_loops"] == 1 and facts["kind"] == "object"
    assert main(["inspect", str(file)]) == 0
    assert "4 vertices, 2 faces, 1 component, genus 0" in capsys.readouterr().out


def test_inspect_answers_for_every_real_asset(assets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted(
        path for path in assets.rglob("*") if path.suffix in (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
    )
    assert len(files) > 5
    for path in files:
        assert main(["inspect", str(path), "--json"]) == 0, path.name
        assert json.loads(capsys.readouterr().out)["mesh"]["vertices"] > 0


def edited(path: Path) -> None:
    """A document with one painted patch that was then renamed."""
    mesh = meshes.plane(4)
    with Session.open(path, discover=False) as session:
        session.surfaces.add("sheet", mesh)
        points = SurfacePoints.at_vertices(mesh, [6, 7, 8, 12])
        session.patches.paint("first", points, surface="sheet", axis=points[[0, 2]])
        session.save()
        session.patches.rename("first", "second")
        session.save()


def test_history_replay_and_diff(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = tmp_path / "work.json"
    edited(document)
    assert main(["history", str(document)]) == 0
    told = capsys.readouterr().out
    assert "Paint first" in told and "second" in told
    journal = next(path for path in tmp_path.iterdir() if ".journal" in path.name)
    again = tmp_path / "again.json"
    assert main(["replay", str(journal), "--out", str(again), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == str(again)
    assert main(["diff", str(document), str(again)]) == 0
    assert capsys.readouterr().out == "nothing changed\n"
    other = tmp_path / "other.json"
    with Session.open(other, discover=False) as session:
        session.save()
    assert main(["diff", str(other), str(document)]) == 1
    assert "second" in capsys.readouterr().out


def test_plugins_check_fails_where_a_plugin_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plugins", "--check", "--json"]) == 0
    records = json.loads(capsys.readouterr().out)
    assert {record["name"] for record in records} >= {"builtins", "usd", "viewer", "blender"}
    monkeypatch.setenv("CONTACT_PLUGINS", "no_such_module")
    assert main(["plugins", "--check"]) == 1
    assert "! cannot be imported: ModuleNotFoundError" in capsys.readouterr().out


def test_samples_are_listed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["samples", "--json"]) == 0
    names = {sample["name"] for sample in json.loads(capsys.readouterr().out)}
    assert {"human_hand", "mug", "baseball"} <= names
    assert main(["samples", "floor", "--out", str(tmp_path / "floor.glb")]) == 0
    assert main(["inspect", str(tmp_path / "floor.glb"), "--json"]) == 0
    assert main(["samples", "floor"]) == 2
    assert "--out" in capsys.readouterr().err
    assert main(["samples", "floor", "--out", str(tmp_path / "floor.xyz")]) == 2
    assert ".glb" in capsys.readouterr().err


def test_columns_align_and_the_last_runs_free() -> None:
    assert columns([("a", "bb", "long text"), ("ccc", "d", "x")]) == "a    bb  long text\nccc  d   x"
    assert columns([]) == ""


def run_contact(arguments: list[str], **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "contact_core.cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="surrogateescape",
        env={**os.environ, **environment},
    )


def test_whoever_closes_the_pipe_early_hears_no_complaint() -> None:
    """`contact plugins | true`."""
    process = run_contact(["plugins", "--json"])
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait() == 141


@pytest.mark.parametrize("as_json", [[], ["--json"]])
def test_a_terminal_without_umlauts_gets_them_spelt_out(as_json: list[str], tmp_path: Path) -> None:
    process = run_contact(
        ["new-plugin", "studio-a", "--in", str(tmp_path / "b\u00fc\u624b"), *as_json], PYTHONIOENCODING="ascii"
    )
    out, err = process.communicate()
    assert process.returncode == 0 and err == "" and "b\\u00fc\\u624b" in out.replace("\\xfc", "\\u00fc")
    if as_json:
        assert json.loads(out)["written"] == str(tmp_path / "b\u00fc\u624b" / "studio-a")


class Careless(Shout):
    name = "careless"

    def run(self, arguments: argparse.Namespace) -> int:
        warnings.warn("invalid value encountered in divide", RuntimeWarning, stacklevel=1)
        if arguments.word == "memory":
            raise MemoryError
        raise InvalidInput("two\nlines,\nand no more.")


def test_libraries_do_not_mumble_between_a_command_and_its_error(capsys: pytest.CaptureFixture[str]) -> None:
    module = ModuleType("careless")
    module.contact_cli = hookimpl(lambda: [Careless])  # type: ignore[attr-defined]
    plugins = PluginManager([module], discover=False)
    assert main(["careless", ""], plugins=plugins) == 2
    assert capsys.readouterr() == ("", "contact: two lines, and no more.\n")
    assert main(["careless", "memory"], plugins=plugins) == 2
    assert capsys.readouterr().err.startswith("contact: the memory of this machine does not suffice")
