"""What every clause of the host contract has at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import pytest

from contact_core.scene.host import SceneSpace, StoredDocument
from contact_core.testing.host_checks import object_id, readable_state, store, stored
from contact_core.testing.host_scenes import HostScene, bent, contract_scene

Build = Callable[[HostScene], Any]  # Any: which capabilities a host has is what is tested


class HostGround:
    """What the clauses stand on: a host on the contract's scene, and what a subject may override."""

    spaces: ClassVar[tuple[SceneSpace, ...]] = (SceneSpace(1.0, "Y"), SceneSpace(0.01, "Z"))
    cannot: ClassVar[Mapping[str, str]]  # of the contract

    @pytest.fixture
    def host(self, build: Build) -> Any:
        """A host on the contract's scene, in the first of `spaces`."""
        return build(contract_scene(self.spaces[0]))

    def reopen(self, host: Any, path: Path) -> Any:
        """Save the host's scene and open it anew."""
        host.save(path)
        return type(host).open(path)

    def foreign_edit(self, host: Any) -> None:
        """One undoable edit that is none of ours, made with the host's own means, as its user would."""
        raise NotImplementedError("give foreign_edit, or decline `foreign_edits`")

    def choice_of(self, group: str) -> str:
        """What `choose_bones` takes for a group of joints of the scene (`SceneRig.groups`)."""
        raise NotImplementedError("give choice_of, or decline `bones`")

    def scene_state(self, host: Any) -> Any:
        """Comparable state of the whole scene; override with something that also sees what hosts do not read."""
        return readable_state(host)

    def furnish(self, host: Any) -> StoredDocument:
        """Store a document and, where the host can, a pose and a key."""
        document = stored(5, {"a": '{"a": 1}', "b": '{"b": 2}'})
        store(host, document)
        if "poses" not in self.cannot:
            rig_id = object_id(host, "arm")
            rig = host.read_rig(rig_id).rig
            host.write_pose(rig_id, bent(rig, 8))
            if "keys" not in self.cannot:
                host.write_pose(rig_id, bent(rig, 9), 3.0)
        return document

    def write_step(self, host: Any, revision: int) -> None:
        """One step that stores a document and, where the host can, poses."""
        with host.step(f"Step {revision}"):
            store(host, stored(revision, {"all": "{}", f"only_{revision}": str(revision)}))
            if "poses" not in self.cannot:
                rig_id = object_id(host, "arm")
                host.write_pose(rig_id, bent(host.read_rig(rig_id).rig, revision))
