"""Blender's tests run in a Blender: here when this Python has bpy, else in an environment beside this one.

In the main suite every test of this folder is collected as usual, and each module runs once, in one process of the
other environment; the reports come back as pytest-xdist's do. So each test passes, fails and counts by itself.
Modules here therefore import neither bpy nor the adapter's own modules at their top.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[2]
REPORTS = "CONTACT_BLENDER_REPORTS"  # where the inner run writes its reports
IN_BLENDER = importlib.util.find_spec("bpy") is not None

_spec = importlib.util.spec_from_file_location("blender_run_tests", REPOSITORY / "adapters/blender/run_tests.py")
assert _spec is not None and _spec.loader is not None
run_tests = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(run_tests)


if IN_BLENDER:
    sys.path.insert(0, str(HERE))  # for blender_scenes, which imports bpy

    @pytest.fixture
    def bpy() -> Any:
        """Blender as the test before left it: tests build their own scene, or ask for an `empty` one."""
        import bpy

        return bpy

    @pytest.fixture(autouse=True)
    def _nobody_listens_any_more() -> Iterator[None]:
        """Sessions that a test did not close follow no undo of the next."""
        yield
        if "bpy" in sys.modules:
            for handlers in (sys.modules["bpy"].app.handlers.undo_post, sys.modules["bpy"].app.handlers.redo_post):
                handlers.clear()

    @pytest.fixture
    def scenes() -> Any:
        """The module that makes Blender scenes by Blender's own means."""
        import blender_scenes

        return blender_scenes

    @pytest.fixture
    def empty(bpy: Any, scenes: Any) -> Any:
        """A host on an empty scene with nothing to undo."""
        bpy.ops.wm.read_factory_settings(use_empty=True)
        return scenes.BlenderHost()

    def pytest_runtest_logreport(report: pytest.TestReport) -> None:
        if REPORTS in os.environ:
            with Path(os.environ[REPORTS]).open("a") as stream:
                stream.write(json.dumps(report._to_json(), default=str) + "\n")

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
        session.config.stash[_STATUS] = int(exitstatus)

    @pytest.hookimpl(trylast=True)
    def pytest_unconfigure(config: pytest.Config) -> None:
        """Leave without Blender's own end: as a module it now and then hangs there (seen in 4.5)."""
        if _STATUS in config.stash:
            if "bpy" in sys.modules:  # which would have removed this folder
                shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
            sys.stdout.flush(), sys.stderr.flush()
            os._exit(config.stash[_STATUS])

    _STATUS = pytest.StashKey[int]()

else:
    _reports: dict[Path, dict[str, list[pytest.TestReport]]] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
        if HERE not in item.path.parents:
            return None
        if item.path not in _reports:
            _reports[item.path] = _run_module(item)
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in _reports[item.path].get(item.nodeid) or [_missing(item)]:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        # The test before left standing what it shares with this one; what the next does not share goes now.
        item.session._setupstate.teardown_exact(nextitem)
        return True

    def _run_module(item: pytest.Item) -> dict[str, list[pytest.TestReport]]:
        """Run all chosen tests of an item's module in Blender; reports by node id."""
        try:
            python = run_tests.environment()
        except run_tests.Unavailable as reason:
            return {other.nodeid: [_report(other, "skipped", (str(item.path), 0, f"Skipped: {reason}"))]
                    for other in item.session.items}  # fmt: skip
        target = Path(str(item.config.rootpath)) / ".venvs" / f"reports-{os.getpid()}.jsonl"
        try:
            chosen = [other.nodeid for other in item.session.items if other.path == item.path]
            done = run_tests.run(python, chosen, **{REPORTS: str(target)})
            found: dict[str, list[pytest.TestReport]] = {}
            for line in target.read_text().splitlines() if target.is_file() else []:
                report = pytest.TestReport._from_json(json.loads(line))
                if isinstance(report.longrepr, list):  # a skip's place and reason: JSON knows no tuples
                    report.longrepr = tuple(report.longrepr)
                found.setdefault(report.nodeid, []).append(report)
            item.config.stash[_SAID] = done.stdout[-4000:] + done.stderr[-4000:]
            return found
        finally:
            target.unlink(missing_ok=True)

    _SAID = pytest.StashKey[str]()

    def _missing(item: pytest.Item) -> pytest.TestReport:
        """A test of which no report came: Blender ended before it."""
        said = item.config.stash.get(_SAID, "")
        return _report(item, "failed", f"Blender told nothing of this test; its process said:\n{said}")

    def _report(item: pytest.Item, outcome: Any, longrepr: Any) -> pytest.TestReport:
        return pytest.TestReport(
            item.nodeid, item.location, {}, outcome, longrepr, "call", user_properties=item.user_properties
        )
