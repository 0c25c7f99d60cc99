"""The cache: a convenience that never stands in the way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact_core.cache import cache_directory, cached_arrays


def test_arrays_are_made_once_and_a_damaged_file_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))
    made: list[int] = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"x": np.arange(20_000) % 7}

    first = cached_arrays("kind", "key", make)
    assert (cached_arrays("kind", "key", make)["x"] == first["x"]).all() and len(made) == 1
    (kept,) = (tmp_path / "kind").iterdir()
    whole = kept.read_bytes()
    for damaged in (b"", whole[: len(whole) // 2], whole[:200] + bytes(100) + whole[300:]):
        kept.write_bytes(damaged)
        assert (cached_arrays("kind", "key", make)["x"] == first["x"]).all()
    assert len(made) == 4 and [path.name for path in (tmp_path / "kind").iterdir()] == ["key.npz"]


def test_what_ends_the_writing_leaves_no_litter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", interrupted)
    with pytest.raises(KeyboardInterrupt):
        cached_arrays("kind", "key", lambda: {"x": np.zeros(3)})
    assert list((tmp_path / "kind").iterdir()) == []


def test_a_user_without_a_home_has_a_cache_all_the_same(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A container runs under any number; then Python knows no home directory."""

    def homeless(self: Path) -> Path:
        if self.parts[:1] == ("~",):
            raise RuntimeError("Could not determine home directory.")
        return self

    monkeypatch.delenv("CONTACT_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setattr(Path, "expanduser", homeless)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    found = cache_directory()
    assert found is not None and found.parent == tmp_path
