"""What was edited and not yet saved, kept on the disk with every step: a killed server loses nothing.

The document alone is kept (a few kilobytes), under the names of the files that it belongs to.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.document.document import ContactDocument
from contact_core.document.schema import dump_document, parse_document
from contact_core.errors import ContactError
from contact_core.session import DocumentChanged, Session

log = logging.getLogger(__name__)
_MAX = 1 << 28  # bytes


def state_directory() -> Path:
    """Where this user's programs keep what is not to be lost. `CONTACT_STATE` names another."""
    named = os.environ.get("CONTACT_STATE")
    if named:
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "contact-core"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "contact-core"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "contact-core"


class Recovery:
    """Keeps the document of a session under the sources that it was opened from, until it is saved."""

    def __init__(self, sources: Sequence[str], folder: Path | None = None) -> None:
        names = "\n".join(
            source if source.startswith("sample:") else str(Path(source).resolve()) for source in sources
        )
        key = sha256(names.encode()).hexdigest()[:24]
        self.failure = ""  # why the last step could not be kept
        self.path = (folder or state_directory()) / "unsaved" / f"{key}.json"

    def found(self) -> ContactDocument | None:
        """What an earlier run left; None where it ended in order."""
        if not self.path.exists():
            return None
        try:
            return parse_document(read_bounded(self.path, _MAX), self.path.name)
        except ContactError as error:
            log.warning("what was not saved cannot be read: %s", error)
            return None

    def follow(self, session: Session) -> None:
        """Keep every step of a session from now on."""
        session.listen(lambda change: self._keep(session, change))

    def forget(self) -> None:
        """Everything is saved, or not wanted."""
        self.path.unlink(missing_ok=True)
        self.failure = ""

    def _keep(self, session: Session, change: DocumentChanged) -> None:
        if change.kind in ("preview", "frame"):
            return
        try:
            if session.history.is_clean:
                self.forget()
                return
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(self.path, dump_document(session.timed_document))
            self.failure = ""
        except (OSError, ContactError) as error:  # a full disk: the edit stands all the same
            self.failure = f"this step is not kept against a crash ({error}): save it."
            log.warning("%s", self.failure)
