"""The script in adapters/usd/README.md runs, and its commands exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from contact_core.cli import main
from contact_usd.host import UsdHost


def test_the_script_runs(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (repository / "adapters" / "usd" / "README.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    exec(compile(script, "README.md", "exec"), {})
    stamp = UsdHost(tmp_path / "ring.contact.usda").stored_stamp()
    assert stamp is not None and stamp.revision == 2  # surface, patch; the turn was undone


@pytest.mark.parametrize("action", ["inspect", "export", "transfer", "solve"])
def test_the_commands_exist(action: str, repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"contact usd {action}" in (repository / "adapters" / "usd" / "README.md").read_text(encoding="utf-8")
    with pytest.raises(SystemExit) as done:
        main(["usd", action, "--help"])
    assert done.value.code == 0 and "usage" in capsys.readouterr().out
