"""Names of meshes: hulls and coarser copies are told from surfaces, and nothing is left without one."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.scene.mesh_names import MeshNames, is_hull, level_of, shown

WORDS = st.sampled_from(
    ["Chair", "Chair_LOD0", "Chair_LOD1", "Chair_LOD2", "UCX_Chair", "BoxCollider", "Mug", "LOD1", ""]
)
NAMES = st.builds(MeshNames, st.tuples(WORDS) | st.tuples(WORDS, WORDS), st.lists(WORDS, max_size=3).map(tuple))


@pytest.mark.parametrize(
    "name",
    ["UCX_mug_01", "ubx_a", "Box Collider", "MeshCollider", "Hand_Collision", "hand-colonly", "NavMesh", "nav_mesh",
     "HITBOX", "door-navmesh", "mug_convcolonly"],
)  # fmt: skip
def test_it_is_a_hull(name: str) -> None:
    assert is_hull(name)


@pytest.mark.parametrize("name", ["Column", "collada_x", "Colander", "mug-col", "navy mesh", "hull", "Ucx", ""])
def test_it_is_no_hull(name: str) -> None:
    assert not is_hull(name)


@pytest.mark.parametrize(
    ("name", "base", "level"),
    [("Chair_LOD0", "chair", 0), ("ChairLOD1", "chair", 1), ("chair.lod2", "chair", 2), ("melodic", "melodic", 0),
     ("Chair_LOD1.001", "chair", 1), ("LOD1_chair", "chair", 1), ("chair lod_3", "chair", 3), ("LOD12", "", 12),
     ("explod3", "explod3", 0), ("Chair_LOD", "chair_lod", 0), ("Chair_LOD128", "chair_lod128", 0)],
)  # fmt: skip
def test_the_level_of_a_name(name: str, base: str, level: int) -> None:
    assert level_of(name) == (base, level)


@pytest.mark.parametrize(
    ("names", "kept"),
    [
        ([("Chair",), ("Chair_LOD1",), ("Chair_LOD2",)], [0]),
        ([("Chair_LOD2",), ("Chair_LOD0",), ("Chair_LOD1",)], [1]),
        ([("Chair_LOD1",), ("Chair_LOD2",)], [0]),
        ([("Chair_LOD1",), ("Table",)], [0, 1]),
        ([("UCX_Chair",), ("Chair_LOD1",)], [1]),
        ([("UCX_Chair_LOD1",), ("UCX_Chair",)], [1]),
        ([("node_1", "Chair"), ("node_2", "Chair_LOD1")], [0]),
    ],
)
def test_the_finest_is_shown(names: list[tuple[str, ...]], kept: list[int]) -> None:
    found, notes = shown([MeshNames(own) for own in names])
    assert found == kept and bool(notes) == (kept != list(range(len(names))))


def test_groups_say_levels_and_hulls() -> None:
    within = [("LOD0",), ("LOD1",), ("Colliders", "Chair"), ("Chair",), ("Chair_LOD1", "Table")]
    assert shown([MeshNames(("Mesh",), around) for around in within])[0] == [0, 3, 4]


@given(st.lists(NAMES, min_size=1, max_size=8))
def test_something_is_always_shown_and_what_is_not_is_told(names: list[MeshNames]) -> None:
    kept, notes = shown(names)
    assert kept == sorted(set(kept)) and kept
    told = " ".join(notes)
    assert all(names[k].own[0] in told for k in range(len(names)) if k not in kept)
    assert bool(notes) or len(kept) == len(names)
