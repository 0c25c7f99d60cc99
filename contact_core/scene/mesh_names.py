"""What the names of meshes say of a scene: which are drawn for an artist, and which stand in for them.

Engines keep coarser copies of a mesh (`Chair_LOD1`) and hulls for physics and navigation (`UCX_Chair`,
`Chair_Collider`) beside it. They lie in or on the surface that is seen, so a patch or a closing finger would
meet them instead of it.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

# Unreal's prefixes; words of Unity, Godot and simulators. (Godot's "-col" is not among them: it draws those.)
HULL_PREFIXES = ("ucx_", "ubx_", "usp_", "ucp_", "mcdcx_")
HULL_WORDS = frozenset(
    (
        "collider",
        "colliders",
        "collision",
        "collisions",
        "navmesh",
        "colonly",
        "convcolonly",
        "occonly",
        "hitbox",
        "hitboxes",
    )
)
_PARTS = re.compile(r"[^\W\d_]+|\d+")
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[^A-Z]+")
# "Chair_LOD1", "chair.lod2", "Chair_LOD1_Mesh", "LOD1"; Blender appends ".001" to a name that it has already
_LEVEL = re.compile(r"(?:^|[\W_]|(?<=[a-z0-9])(?=(?-i:LOD|Lod)))lod[\W_]?(\d{1,2})(?=$|[\W_])", re.IGNORECASE)
MOST_AROUND = 8  # of what a mesh lies in, names that are looked at
_TOLD = 8  # names in a sentence
_Key = tuple[str, ...]
_COPY_NUMBER = re.compile(r"[._]\d{3}$")


@lru_cache(maxsize=4096)
def is_hull(name: str) -> bool:
    """Whether a name says that a mesh is there for physics or navigation."""
    plain = unicodedata.normalize("NFKC", name)
    parts: list[str] = _PARTS.findall(plain)
    words = [word.lower() for part in parts for word in _WORDS.findall(part)]
    joined = {a + b for a, b in pairwise(words)} & {"navmesh", "colonly", "convcolonly"}
    return plain.lower().startswith(HULL_PREFIXES) or bool(joined) or not HULL_WORDS.isdisjoint(words)


@lru_cache(maxsize=4096)
def level_of(name: str) -> tuple[str, int]:
    """The name of what a mesh is a level of, and which: ("chair", 1) of "Chair_LOD1", 0 where nothing is said."""
    plain = _COPY_NUMBER.sub("", unicodedata.normalize("NFKC", name))
    found = _LEVEL.search(plain)
    if found is None:
        return plain.casefold(), 0
    return (plain[: found.start()] + plain[found.end() :]).strip(" ._-").casefold(), int(found[1])


@dataclass(frozen=True)
class MeshNames:
    """The names of one mesh: its own (of its node, of its data), and those of what it lies in, from within."""

    own: tuple[str, ...]
    around: tuple[str, ...] = ()

    @property
    def every(self) -> tuple[str, ...]:
        return (*self.own, *self.around[:MOST_AROUND])

    @property
    def told(self) -> str:
        """What the mesh is called in a sentence, with the name that says what it is."""
        first = self.own[0]
        saying = next((name for name in self.every if is_hull(name) or level_of(name)[1]), first)
        return first if saying == first else f"{first} ({saying})"

    def keys(self) -> list[tuple[_Key, int]]:
        """What this mesh may be a level of, by each of its names, the innermost first, and the level each says."""
        outer = [(name, self.around[:MOST_AROUND]) for name in self.own]
        outer += [(name, self.around[k + 1 : MOST_AROUND]) for k, name in enumerate(self.around[:MOST_AROUND])]
        return [_key(name, around) for name, around in outer]


def stand_ins(names: Sequence[MeshNames]) -> tuple[list[int], list[int]]:
    """Of meshes those that are hulls, and those that are coarser copies of another, by number.

    A level is only a copy where a finer one is there: with the finest gone, the next stands for it. Where there is
    nothing but hulls, they are a surface too.
    """
    hulls = [k for k, told in enumerate(names) if any(map(is_hull, told.every))]
    others = sorted(set(range(len(names))) - set(hulls)) or hulls
    said, finest = dict[int, tuple[_Key, int]](), dict[_Key, int]()
    for k in others:
        keys = names[k].keys()
        said[k] = next((told for told in keys if told[1]), (keys[0][0], 0))
        for key, _ in keys:  # each name counts with the level of the mesh, so the finest mesh is never a copy
            finest[key] = min(finest.get(key, said[k][1]), said[k][1])
    return hulls, [k for k, (key, level) in said.items() if level > finest[key]]


def shown(names: Sequence[MeshNames]) -> tuple[list[int], list[str]]:
    """The meshes that are a surface to pose or paint, by number, and notes on the others and on hulls that are all
    there is."""
    hulls, copies = stand_ins(names)
    notes = []
    if hulls and len(hulls) == len(names):
        notes.append(
            f"Its meshes are all named as hulls for physics, and were read as its surface: {_told(names, hulls)}."
        )
        hulls = []
    elif hulls:
        notes.append(
            f"Hulls for physics or navigation, which are never drawn, were left out: {_told(names, hulls)}."
        )
    if copies:
        notes.append(f"Coarser copies of a mesh (levels of detail) were left out: {_told(names, copies)}.")
    left = {*hulls, *copies}
    return [k for k in range(len(names)) if k not in left], notes


def _key(name: str, around: Sequence[str]) -> tuple[_Key, int]:
    base, level = level_of(name)
    return (base, *(outer for outer in around if level_of(outer)[0] != base)), level


def _told(names: Sequence[MeshNames], which: Sequence[int]) -> str:
    more = len(which) - _TOLD
    return ", ".join(names[k].told for k in which[:_TOLD]) + (f" and {more} more" if more > 0 else "")
