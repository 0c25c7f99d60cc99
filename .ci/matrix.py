"""The core tests in the environments that studios run (VFX Reference Platform), each where its Python is found.

The environments stay in .venvs/ and are made again when pyproject.toml or their constraints change.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENTS = {"py311-numpy1": "3.11", "py313-numpy2": "3.13"}  # py311-numpy2 is what `make pytest` runs
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONPATH": ""}


def interpreter(version: str) -> str | None:
    """A Python of this version: this one, one on the PATH, or one of pyenv's."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    on_path = shutil.which(f"python{version}")
    for candidate in (sys.executable, on_path, *sorted(map(str, pyenv.glob(f"{version}*/bin/python")))):
        if candidate and answers(candidate, version):
            return candidate
    if on_path:  # a pyenv shim answers only for the versions that are switched on, but tells where the others are
        shims = Path(on_path).parent.parent / "versions"
        return next(
            (str(p) for p in sorted(shims.glob(f"{version}*/bin/python")) if answers(str(p), version)), None
        )
    return None


def answers(python: str, version: str) -> bool:
    say = "import sys; print('%d.%d' % sys.version_info[:2])"
    try:
        run = subprocess.run([python, "-c", say], capture_output=True, text=True, timeout=30, check=False)
    except OSError:
        return False
    return run.returncode == 0 and run.stdout.strip() == version


def prepared(name: str, python: str) -> Path:
    """The environment's interpreter, everything installed."""
    constraints = ROOT / "constraints" / f"{name}.txt"
    wanted = hashlib.sha256(constraints.read_bytes() + (ROOT / "pyproject.toml").read_bytes()).hexdigest()
    home = ROOT / ".venvs" / name
    stamp = home / ".ready"
    inside = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not stamp.exists() or stamp.read_text() != wanted:
        shutil.rmtree(home, ignore_errors=True)
        subprocess.run([python, "-m", "venv", str(home)], check=True)
        install = [str(inside), "-m", "pip", "install", "--quiet", "-c", str(constraints)]
        subprocess.run(
            [*install, "-e", f"{ROOT}[testing,io,solvers,samples]", "pytest-xdist", "trimesh"], check=True
        )
        stamp.write_text(wanted)
    return inside


def main() -> None:
    failed = []
    for name, version in ENVIRONMENTS.items():
        python = interpreter(version)
        if python is None:
            print(f"{name}: left out, there is no Python {version} here")
            continue
        inside = prepared(name, python)
        print(f"{name}: the core tests with {python}", flush=True)
        tests = [str(inside), "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", "tests/core"]
        if subprocess.run(tests, cwd=ROOT, env={**os.environ, **ONE_THREAD}, check=False).returncode:
            failed.append(name)
    if failed:
        sys.exit(f"the core tests fail in: {', '.join(failed)}")


if __name__ == "__main__":
    main()
