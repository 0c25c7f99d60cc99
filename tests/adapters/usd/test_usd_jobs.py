"""Shots keep the contract of jobs."""

from __future__ import annotations

from pathlib import Path

import pytest

from contact_core.cli import main
from contact_core.testing.job_kind_contract import JobKindContract
from contact_usd.jobs import ShotJob


class TestShotJob(JobKindContract):
    @pytest.fixture
    def kind(self) -> ShotJob:
        return ShotJob()

    @pytest.fixture
    def example(self, sequence: Path) -> Path:
        shot = sequence / "shot010.usda"
        assert main(["usd", "transfer", str(sequence / "contacts.usda"), str(shot)]) == 0
        return shot.with_name("shot010.contact.usda")

    @pytest.fixture
    def reads(self, example: Path) -> list[Path]:
        return [example.with_name("shot010.usda"), example.with_name("asset.usda")]
