"""A grasp of the starter library put on a baseball, kept, saved under a name and put on a mug."""

from __future__ import annotations

import tempfile
from pathlib import Path

import contact_core as contact
from contact_core.library.starter import starter_library
from contact_core.library.verbs import apply_grasp, save_grasp


def main() -> None:
    studio = contact.Library(Path(tempfile.mkdtemp()) / "grasps")
    with contact.new(hand="sample:human_hand", ball="sample:baseball") as session:
        found = apply_grasp(session, starter_library(), "power sphere", "hand", "ball")
        session.accept(found[0].suggestion.proposal)
        save_grasp(session, studio, "ball in the palm", "hand", "ball", tags=("sport",))
    with contact.new(hand="sample:human_hand", mug="sample:mug") as session:
        (again,) = apply_grasp(session, studio, "ball in the palm", "hand", "mug")
        session.accept(again.suggestion.proposal)
        print(f"{', '.join(studio.names())}: {len(session.document.pairs)} contacts on the mug")
        for note in again.notes:
            print(note)


if __name__ == "__main__":
    main()
