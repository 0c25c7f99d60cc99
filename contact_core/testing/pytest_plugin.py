"""pytest plugin of the contract kit: skips declined clauses with their reason; `--contact-report` prints the table.

Loaded into every pytest run of an environment that has contact-core, so it imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from contact_core.testing.contract import Contract
from contact_core.testing.report import PROPERTY, ContractReport

_REPORT = pytest.StashKey[ContractReport]()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("contact", "contact-core contract suites")
    group.addoption("--contact-report", action="store_true", help="print which subject keeps which clause")
    group.addoption(
        "--contact-report-file", metavar="PATH", help="write the same as Markdown or, for a name in .json, as JSON"
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_REPORT] = ContractReport()
    config.pluginmanager.register(_Collector(config.stash[_REPORT]), "contact-report-collector")


def pytest_collection_modifyitems(config: pytest.Config, items: Sequence[pytest.Item]) -> None:
    for item in items:
        suite = getattr(item, "cls", None)
        if not (isinstance(suite, type) and issubclass(suite, Contract)):
            continue
        clause = suite.clause_of(getattr(item, "originalname", item.name))
        if clause is None:
            continue
        reason = suite.declined(clause)
        item.user_properties.append((PROPERTY, [suite.about, suite.subject, clause.id, clause.text, reason]))
        if reason is not None:
            item.add_marker(pytest.mark.skip(reason=f"declined: {reason}"))
        if config.option.collectonly:
            config.stash[_REPORT].promised(suite.about, suite.subject, clause.id, clause.text, reason)


class _Collector:
    """Hears every report; also those that xdist's workers send, since user properties travel with them."""

    def __init__(self, report: ContractReport) -> None:
        self.report = report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        for key, value in report.user_properties:
            if key == PROPERTY and isinstance(value, list | tuple):
                self.report.ran(*value, outcome=report.outcome, when=report.when)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    report = config.stash[_REPORT]
    if config.getoption("--contact-report"):
        terminalreporter.section("contract clauses by subject")
        terminalreporter.write_line(report.text() or "no contract suite ran")
    path = config.getoption("--contact-report-file")
    if path:
        text = report.json() if path.endswith(".json") else report.markdown()
        Path(path).write_text(text, encoding="utf-8")
