"""What compilation promises: lazily, quietly, wherever directories can be written, and with counting off."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from contact_core.geometry import jit


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    import os

    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, timeout=300
    )


def test_importing_the_package_imports_no_numba() -> None:
    code = (
        "import sys; import contact_core.geometry as g; g.log_map, g.trace_geodesic, g.SurfacePoints;"
        "sys.exit('numba' in sys.modules)"
    )
    assert run(code).returncode == 0


def test_reference_counting_is_off_in_this_numba() -> None:
    assert jit.reference_counting_is_off()


def test_without_a_directory_to_write_to_kernels_compile_uncached(monkeypatch: pytest.MonkeyPatch) -> None:
    real = jit.numba.njit

    def no_place(*functions: object, cache: bool = False, **options: object) -> object:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return real(*functions, **options)

    monkeypatch.setattr(jit.numba, "njit", no_place)

    def double(x: float) -> float:
        return 2.0 * x

    assert jit.kernel(double)(2.0) == 4.0


def test_a_first_compile_says_so_once_and_the_next_process_does_not(tmp_path: Path) -> None:
    code = (
        "from contact_core.geometry.topology_kernels import following, preceding;"
        "assert following(2) == 0 and preceding(0) == 2"
    )
    first = run(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert first.returncode == 0, first.stderr
    assert first.stderr.count("compiling geodesic kernels, once on this machine") == 1
    second = run(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert second.returncode == 0
    assert second.stderr == ""


def test_unknown_names_are_refused_with_those_that_exist() -> None:
    import contact_core.geometry as geometry

    with pytest.raises(AttributeError, match="trace_geodesic"):
        geometry.shoot
    assert "log_map" in dir(geometry)
