"""A Blender with a window for tests: found, given a screen and a profile with our extension, and run for one act.

`CONTACT_BLENDER` names the program (or a command that starts it in some other root, with the same paths); without
it `blender` on the PATH is taken. The screen is Xvfb's. Where one is missing, `Unavailable` says what to install.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[2]
OLDEST = (4, 2)
PATIENCE = 900  # seconds for one act; the first compiles kernels, on a busy machine for minutes
SIZE = (1280, 800)

_spec = importlib.util.spec_from_file_location(
    "build_extension", REPOSITORY / "adapters" / "blender" / "build_extension.py"
)
assert _spec is not None and _spec.loader is not None
build_extension: Any = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(build_extension)


class Unavailable(Exception):
    """No Blender with a window can be had here; the text says what is missing."""


@functools.cache
def blender() -> tuple[str, tuple[int, int], str]:
    """(command, Blender's version, its Python's version). Raises Unavailable."""
    named = os.environ.get("CONTACT_BLENDER") or "blender"
    program = shutil.which(named)
    if program is None:
        raise Unavailable(
            f"there is no {named!r} here: install Blender 4.2 or later and name it in CONTACT_BLENDER (Debian 13"
            " has 4.3, Debian sid 5.2; a chroot will do), and Xvfb (package xvfb)"
        )
    if shutil.which("Xvfb") is None:
        raise Unavailable("there is no Xvfb for a screen: install the package xvfb")
    said = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60).stdout
    version = re.search(r"Blender (\d+)\.(\d+)", said)
    if version is None or (int(version[1]), int(version[2])) < OLDEST:
        raise Unavailable(f"{program} is no Blender of 4.2 or later: {said.strip()[:60]!r}")
    asked = run_blender(program, "-b", "--factory-startup", "--python-expr",
                     "import sys; print('python %d.%d' % sys.version_info[:2])")  # fmt: skip
    python = re.search(r"python (\d+\.\d+)", asked.stdout)
    if python is None:
        raise Unavailable(f"{program} runs no Python: {asked.stderr.strip()[-200:]}")
    return program, (int(version[1]), int(version[2])), python[1]


def run_act(source: Path, name: str, pictures: Path) -> None:
    """Start Blender, let it do one act of a test module, and fail as it failed; skips where there is no Blender.

    pictures: where those that it took are kept, unless CONTACT_PICTURES names another folder.
    """
    try:
        program, _, python = blender()
    except Unavailable as reason:
        pytest.skip(str(reason))
    folder = Path(os.environ.get("CONTACT_PICTURES") or pictures)
    folder.mkdir(parents=True, exist_ok=True)
    with screen() as (display, frame), tempfile.TemporaryDirectory(prefix="contact-window-") as scratch:
        width, height = map(str, SIZE)
        report = Path(scratch) / "report.json"
        done = run_blender(
            program, "--factory-startup", "--enable-event-simulate", "--window-geometry", "0", "0", width, height,
            "--python-exit-code", "3", "--python", str(HERE / "blender_driver.py"),
            "--", str(source), name, scratch, str(frame),
            DISPLAY=display, BLENDER_USER_RESOURCES=str(profile(program, python)), CONTACT_CACHE=str(_samples()),
        )  # fmt: skip
        for picture in Path(scratch).glob("*.png"):
            shutil.copy(picture, folder / f"{name}-{picture.name}")
        said = done.stdout[-4000:] + done.stderr[-4000:]
        assert report.is_file(), f"Blender ended before the act did:\n{said}"
        told = json.loads(report.read_text(encoding="utf-8"))
    (folder / f"{name}.txt").write_text("\n".join(told["said"]), encoding="utf-8")
    assert not told["failure"], f"{told['failure']}\n{said}"
    assert "Traceback" not in done.stdout + done.stderr, said


@contextlib.contextmanager
def screen() -> Iterator[tuple[str, Path]]:
    """(display, the file that holds its pixels) of a screen of its own."""
    with tempfile.TemporaryDirectory(prefix="contact-screen-") as folder:
        ready, told = os.pipe()
        width, height = SIZE
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(told), "-screen", "0", f"{width}x{height}x24", "-fbdir", folder],
            pass_fds=(told,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(told)
        try:
            with os.fdopen(ready) as stream:
                number = stream.readline().strip()
            assert number, "Xvfb did not start"
            yield f":{number}", Path(folder) / "Xvfb_screen0"
        finally:
            server.terminate()
            server.wait()


@functools.cache
def profile(program: str, python: str) -> Path:
    """A user's folder of Blender with our extension installed from its zip, of the sources as they are now.

    Kept under .venvs for the same wheels; our own sources in it are brought up to date, file by file, so that
    kernels that were compiled stay.
    """
    wheels = _wheels(python)
    key = hashlib.sha256(" ".join([program, *(path.name for path in wheels)]).encode()).hexdigest()[:8]
    folder = REPOSITORY / ".venvs" / f"blender-window-{python}-{key}"
    installed = folder / "extensions" / "user_default" / "contact_core"
    if not installed.is_dir():
        shutil.rmtree(folder, ignore_errors=True)
        target = zipped(folder / "contact.zip", python)
        done = run_blender(
            program, "-b", "--command", "extension", "install-file", "-r", "user_default", "--enable", str(target),
            BLENDER_USER_RESOURCES=str(folder),
        )  # fmt: skip
        target.unlink()
        assert installed.is_dir(), done.stdout + done.stderr
    _renewed(installed)
    return folder


@functools.cache
def _samples() -> Path:
    """A cache with the samples that acts use: making one needs libraries that the extension has not."""
    folder = REPOSITORY / ".venvs" / "blender-window-cache"
    names = ("human_hand", "baseball", "mug")
    make = f"import contact_core; [contact_core.read_asset(f'sample:{{name}}') for name in {names}]"
    made = subprocess.run(
        [sys.executable, "-c", make],
        env={**os.environ, "CONTACT_CACHE": str(folder)},
        capture_output=True,
        text=True,
    )
    if made.returncode:
        pytest.skip(f"no samples: {made.stderr.strip().splitlines()[-1]}")
    return folder


def zipped(target: Path, python: str) -> Path:
    """The extension's zip for this Blender."""
    build_extension.BLENDERS[python] = ("4.2.0", None)  # distributions build older Blenders with newer Pythons
    built: Path = build_extension.build(target, _wheels(python), python)
    return built


def _renewed(installed: Path) -> None:
    """Bring our own sources of an installed extension up to date."""
    there = {path for path in (installed / "vendor").rglob("*") if path.is_file() and path.suffix == ".py"}
    for relative, data in build_extension.vendored():
        path = installed / "vendor" / relative
        there.discard(path)
        if not path.is_file() or path.read_bytes() != data:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
    for gone in there:
        gone.unlink()


def _wheels(python: str) -> list[Path]:
    """What the extension needs, fetched once. Raises Unavailable."""
    folder = REPOSITORY / ".venvs" / f"wheels-{python}"
    if not (folder / ".ready").is_file():
        folder.mkdir(parents=True, exist_ok=True)
        try:
            build_extension.download(folder, python)
        except build_extension.NotBuilt as reason:
            pytest.skip(f"the wheels of the extension are not here, and {reason}")
        (folder / ".ready").touch()
    return sorted(path for path in folder.glob("*.whl") if not path.name.lower().startswith("numpy-"))


def run_blender(program: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run Blender to its end, or for PATIENCE."""
    own = {"LIBGL_ALWAYS_SOFTWARE": "1", "PYTHONFAULTHANDLER": "1", "SDL_AUDIODRIVER": "dummy"}
    inherited = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME")}
    process = subprocess.Popen(
        [program, *arguments], env={**inherited, **own, **variables}, text=True, errors="replace",
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    try:
        said, complaint = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, complaint = process.communicate()
        complaint += f"\nBlender did not end within {PATIENCE} seconds."
    return subprocess.CompletedProcess(process.args, process.returncode, said, complaint)
