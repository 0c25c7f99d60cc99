"""What compilation promises: lazily, quietly, wherever directories can be written, and with counting off."""

from __future__ import annotations

import ast
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
        "from contact_core.geometry.thinning import first_of_each;"
        "assert first_of_each([[0, 0, 0], [0, 0, 1], [0, 0, 3]], 2).tolist() == [0, 2]"
    )
    first = run(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert first.returncode == 0, first.stderr
    assert first.stderr.count("compiling geodesic kernels, once on this machine") == 1
    second = run(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert second.returncode == 0
    assert second.stderr == ""


PARTS, COMPILED = {"inlined", "inner"}, {"inlined", "inner", "kernel"}


def decorated(tree: ast.Module, by: set[str]) -> list[ast.FunctionDef]:
    return [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(each, ast.Name) and each.id in by for each in node.decorator_list)
    ]


def called_from_python(trees: dict[str, ast.Module]) -> list[str]:
    """Calls of parts of kernels outside of compiled functions, by module: name."""
    parts = {module: {each.name for each in decorated(tree, PARTS)} for module, tree in trees.items()}
    found = []
    for module, tree in trees.items():
        known = set(parts[module])
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                for each in node.names:
                    name = each.asname or each.name
                    if each.name in parts.get(node.module or "", set()):
                        known.add(name)
                    known |= {f"{name}.{part}" for part in parts.get(f"{node.module}.{each.name}", set())}
        inside = {id(call) for each in decorated(tree, COMPILED) for call in ast.walk(each)}
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and id(node) not in inside]
        named = [ast.unparse(node.func) for node in calls]
        found += [f"{module}: {name}" for name in named if name in known]
    return found


def test_python_calls_no_part_of_a_kernel() -> None:
    root = Path(jit.__file__).parents[2]
    files = sorted((root / "contact_core").rglob("*.py"))
    names = {file: ".".join(file.relative_to(root).with_suffix("").parts) for file in files}
    trees = {names[file]: ast.parse(file.read_text(encoding="utf-8")) for file in files}
    assert sum(bool(decorated(tree, PARTS)) for tree in trees.values()) > 8
    assert called_from_python(trees) == [], "they have no entry for Python: a call would end the process"
    wrong = "from m import part\n@kernel\ndef fine(): part()\ndef bad(): part()\n"
    made = {"m": ast.parse("@inner\ndef part(): pass"), "n": ast.parse(wrong)}
    assert called_from_python(made) == ["n: part"]


def test_a_part_of_a_kernel_that_is_called_from_python_says_so() -> None:
    from contact_core.geometry.topology_kernels import following

    with pytest.raises(TypeError, match="following is a part of kernels"):
        following(2)
    assert following.py_func(2) == 0


def test_unknown_names_are_refused_with_those_that_exist() -> None:
    import contact_core.geometry as geometry

    with pytest.raises(AttributeError, match="trace_geodesic"):
        geometry.shoot
    assert "log_map" in dir(geometry)
