"""Files of released versions are read for ever. A golden file never changes; a new version gets its own."""

from __future__ import annotations

from pathlib import Path

from contact_core.document import library, schema
from contact_core.document.codec import pretty, to_json
from contact_core.document.library import load_contact_set
from contact_core.document.schema import dump_document, parse_document
from contact_core.edit import journal_file as journal
from contact_core.edit.journal_file import read_journal
from contact_core.edit.replay import replay


def golden(repository: Path, kind: str) -> dict[int, Path]:
    """The golden files of a kind by version."""
    found = (repository / "tests" / "golden").glob(f"{kind}-v*.*")
    return {int(path.stem.removeprefix(f"{kind}-v")): path for path in found}


def test_every_version_of_each_format_has_a_golden_file(repository: Path) -> None:
    for kind, newest in (
        ("document", schema.VERSION),
        ("contact-set", library.VERSION),
        ("journal", journal.VERSION),
    ):
        assert sorted(golden(repository, kind)) == list(range(1, newest + 1)), kind


def test_documents_are_read_and_the_newest_writes_the_same_bytes(repository: Path) -> None:
    for version, path in golden(repository, "document").items():
        document = parse_document(path.read_bytes())
        assert document.patches and document.pairs and document.poses
        if version == schema.VERSION:
            assert dump_document(document) == path.read_bytes()


def test_contact_sets_are_read(repository: Path) -> None:
    for version, path in golden(repository, "contact-set").items():
        found = load_contact_set(path)
        head = {"schema": library.SCHEMA, "version": version}
        if version == library.VERSION:
            assert (pretty({**head, **to_json(found)}) + "\n").encode() == path.read_bytes()


def test_journals_are_replayed(repository: Path) -> None:
    for path in golden(repository, "journal").values():
        contents = read_journal(path)
        replayed = replay(contents)
        assert replayed.trouble == () and contents.damage is None and contents.closed
        assert len(replayed.history.done) == sum("do" in event for event in contents.events)
