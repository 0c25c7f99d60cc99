"""A third-party distribution, from its wheel, in a clean environment beside ours: the example and the template."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from contact_core.cli import main


def run(*command: str | Path, cwd: Path) -> str:
    """The output of a command that must succeed, without PYTHONPATH and CONTACT_PLUGINS of this process."""
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "CONTACT_PLUGINS")}
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def built(source: Path, into: Path) -> Path:
    """The wheel of a source tree."""
    into.mkdir(exist_ok=True)
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", into, source, cwd=into)
    (wheel,) = into.glob("*.whl")
    return wheel


@pytest.fixture(scope="session")
def our_wheel(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of contact-core as it is now."""
    return built(repository, tmp_path_factory.mktemp("wheel"))


def installed(*wheels: Path, into: Path) -> Path:
    """The interpreter of a new environment with these wheels and, behind them, the libraries of this environment.

    A plain path in a .pth file brings numpy and the others without a download, but follows no .pth file there: an
    editable contact-core stays unseen, and what is imported is the wheel.
    """
    home = into / "environment"
    venv.create(home)
    scripts = home / ("Scripts" if os.name == "nt" else "bin")
    python = scripts / ("python.exe" if os.name == "nt" else "python")
    install = (sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", "--quiet")
    run(*install, *wheels, cwd=into)
    where = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(run(python, "-c", where, cwd=into).strip())
    site.joinpath("libraries.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    ours = Path(run(python, "-c", "import contact_core; print(contact_core.__file__)", cwd=into).strip())
    assert ours.is_relative_to(site), f"contact_core comes from {ours}"
    return python


def offers(python: Path, name: str, scratch: Path) -> dict[str, object]:
    """What `contact plugins` says about one plugin."""
    records = json.loads(run(python, "-m", "contact_core.cli", "plugins", "--json", cwd=scratch))
    (record,) = (record for record in records if record["name"] == name)
    assert record["problems"] == [] and record["origin"] == "entry point"
    (ours,) = (record for record in records if record["name"] == "builtins")
    assert ours["problems"] == []
    return dict(record)


def test_the_example_distribution_works(repository: Path, our_wheel: Path, tmp_path: Path) -> None:
    source = tmp_path / "source"
    shutil.copytree(repository / "examples" / "20_studio_plugin", source)
    clean_python = installed(our_wheel, built(source, tmp_path / "dist"), into=tmp_path)
    shutil.rmtree(source / "src")  # what is tested now is the wheel
    record = offers(clean_python, "studio_grip", tmp_path)
    assert record["source"] == "studio-grip 1.0.0"
    assert record["offers"] == {"axis generator": ["crosswise"], "pose solver": ["l-bfgs-b"]}
    assert " passed" in run(clean_python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests", cwd=source)


def test_the_template_passes_at_once(our_wheel: Path, tmp_path: Path) -> None:
    assert main(["new-plugin", "Studio-Contact", "--in", str(tmp_path), "--quiet"]) == 0
    source = tmp_path / "Studio-Contact"
    clean_python = installed(our_wheel, built(source, tmp_path / "dist"), into=tmp_path)
    shutil.rmtree(source / "src")
    assert offers(clean_python, "studio_contact", tmp_path)["offers"] == {"axis generator": ["studio_contact"]}
    told = run(clean_python, "-m", "pytest", "-p", "no:cacheprovider", "--contact-report", "tests", cwd=source)
    assert "A13  kept" in told


def test_the_template_is_clean(tmp_path: Path) -> None:
    """What a new plugin starts from keeps our own rules."""
    pytest.importorskip("ruff")
    assert main(["new-plugin", "studio-contact", "--in", str(tmp_path), "--quiet"]) == 0
    run(
        sys.executable,
        "-m",
        "ruff",
        "check",
        "--isolated",
        "--select",
        "E,F,UP,B",
        "--line-length",
        "116",
        ".",
        cwd=tmp_path,
    )
    assert main(["new-plugin", "studio-contact", "--in", str(tmp_path), "--quiet"]) == 2  # never overwritten
