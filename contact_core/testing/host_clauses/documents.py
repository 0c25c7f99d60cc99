"""The document in the scene, and files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from contact_core.document.schema import VERSION
from contact_core.errors import FileRefused
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import ACCURACY, object_id, pose_error, store, stored, surfaces_of
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import bent


class DocumentClauses(HostGround):
    """The document in the scene, and files."""

    @needs("document")
    def test_h19_keeps_the_document_bit_for_bit(self, host: Any) -> None:
        """Parts and stamp come back as stored; what is neither put nor removed stays; at first there is nothing."""
        assert host.stored_document() is None and host.stored_stamp() is None
        printable = bytes(range(32, 127)).decode()
        for parts in ({"a": "{}"}, {"Z_9": f"{printable}\n" * 4000, "k" * 63: "\n\n1"}, {"e": ""}, {}):
            document = stored(7, parts)
            store(host, document)
            assert (host.stored_stamp(), host.stored_document()) == (document.stamp, document)
        store(host, stored(8, {"a": "1", "b": "2", "c": "3"}))
        host.store_document(stored(9).stamp, {"b": "22", "d": "4"}, ["c"])
        assert host.stored_document() == stored(9, {"a": "1", "b": "22", "d": "4"})
        assert host.stored_stamp() == stored(9).stamp

    @needs("files")
    def test_h20_survives_save_and_open(self, host: Any, tmp_path: Path) -> None:
        """Document, poses, keys, surfaces and ids are the same after saving and opening."""
        expected = self.furnish(host)
        # What stands after a key was set: in hosts that show one frame, what the keys say there.
        standing: Any = None if "poses" in self.cannot else host.read_pose(object_id(host, "arm"))
        path = tmp_path / f"saved{host.suffixes[0]}"
        again = self.reopen(host, path)
        assert again.stored_document() == expected
        assert surfaces_of(again) == surfaces_of(host)
        if "poses" not in self.cannot:
            rig_id = object_id(again, "arm")
            assert pose_error(again.read_pose(rig_id), standing) < ACCURACY
        if "keys" not in self.cannot:
            rig = again.read_rig(rig_id).rig
            assert again.pose_keys(rig_id) == (3.0,)
            assert pose_error(again.read_pose(rig_id, 3.0), bent(rig, 9)) < ACCURACY

    @needs("document")
    def test_h21_keeps_what_a_newer_release_wrote(self, host: Any) -> None:
        """A document of an unknown future schema is given back bit for bit and never overwritten."""
        newer = stored(3, {"of": '{"from": "the future"}'}, VERSION + 1)
        store(host, newer)
        with pytest.raises(FileRefused, match=str(VERSION + 1)):
            host.store_document(stored(1).stamp, {"a": "{}"}, newer.parts)
        assert host.stored_document() == newer

    @needs("files")
    def test_h22_carries_a_newer_document_through_a_save(self, host: Any, tmp_path: Path) -> None:
        """Saving a scene with a document of a future schema keeps that document."""
        newer = stored(3, {"of": '{"from": "the future"}'}, VERSION + 1)
        store(host, newer)
        again = self.reopen(host, tmp_path / f"newer{host.suffixes[0]}")
        assert again.stored_document() == newer

    @needs("files")
    def test_h23_refuses_damaged_files_in_words(self, host: Any, tmp_path: Path) -> None:
        """A file that is cut short is refused with a sentence; a failed save leaves the old file whole."""
        path = tmp_path / f"whole{host.suffixes[0]}"
        host.save(path)
        whole = path.read_bytes()
        damaged = tmp_path / f"damaged{host.suffixes[0]}"
        damaged.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(FileRefused):
            type(host).open(damaged)
        with pytest.raises(FileRefused):
            host.save(path / f"below_a_file{host.suffixes[0]}")
        assert path.read_bytes() == whole
