"""Testing the kit: subjects that are broken on purpose must fail at the clause named for them, and nowhere else.

A file of mutants, named so that a plain pytest run does not collect it (`mutant_hosts.py`), holds classes such as

    class TestLostScale(Mutant, HostContract):
        breaks = "H04"                  # the clause that must be the first to fail
        consequences = ("H07",)         # clauses that may fail beyond it, because they rest on it

and a test asserts `judge(path)`: each mutant's complaints, empty when it was caught as declared.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import ClassVar

from contact_core.errors import InvalidInput
from contact_core.testing.contract import Contract


class Mutant:
    """Mixed in before the suite; see the module's docstring."""

    breaks: ClassVar[str]
    consequences: ClassVar[tuple[str, ...]] = ()


def judge(path: Path, *, timeout_s: float = 300.0) -> dict[str, str]:
    """Run every mutant in a file, in one process; what is wrong with each, "" where it was caught as declared.

    Raises InvalidInput when the file holds no mutant or cannot be run.
    """
    mutants = _mutants(path)
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [
            sys.executable,
            "-m",
            "pytest",
            str(path),
            "-q",
            "--tb=line",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:randomly",
        ]
        command += ["-c", str(_empty_settings(folder)), "--rootdir", str(path.parent), "--import-mode=importlib"]
        command += ["--contact-report-file", str(report)]
        run = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
        if not report.exists():
            raise InvalidInput(f"{path.name} could not be run:\n{run.stdout[-2000:]}{run.stderr[-2000:]}")
        broken = json.loads(report.read_text(encoding="utf-8"))["broken"]
    return {name: _complaint(mutant, broken.get(name, []), run.stdout) for name, mutant in mutants.items()}


def _mutants(path: Path) -> dict[str, type[Mutant]]:
    """Mutant classes of a file by their name in reports."""
    spec = importlib.util.spec_from_file_location(f"contact_mutants_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InvalidInput(f"{path} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look up the module of their annotations
    spec.loader.exec_module(module)
    found: dict[str, type[Mutant]] = {
        value.subject: value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Mutant)
        and issubclass(value, Contract)
        and value.__name__.startswith("Test")  # what pytest collects; the others are bases of mutants
    }
    if not found:
        raise InvalidInput(f"{path.name} holds no class of both Mutant and a Contract.")
    return found


def _complaint(mutant: type[Mutant], broken: list[str], output: str) -> str:
    if not broken:
        return f"was not caught; {mutant.breaks} should fail"
    if broken[0] != mutant.breaks:
        return f"fails first at {broken[0]}, not at {mutant.breaks}; all that failed: {broken}\n{output[-3000:]}"
    undeclared = sorted(set(broken[1:]) - set(mutant.consequences))
    return f"also fails at {undeclared}, which it does not declare" if undeclared else ""


def _empty_settings(folder: str) -> Path:
    path = Path(folder) / "pytest.ini"
    path.write_text("[pytest]\n", encoding="utf-8")
    return path
