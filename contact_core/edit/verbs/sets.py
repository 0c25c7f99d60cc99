"""Verbs that save contact sets and load them onto the same or another manipulator."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from contact_core.contact.placement import Link, Root
from contact_core.document.document import Patch, Surface
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.library import ContactSet, load_contact_set, save_contact_set
from contact_core.edit.commands import Import
from contact_core.edit.verbs.group import VerbGroup
from contact_core.errors import InvalidInput


class ContactSets(VerbGroup):
    """Patches saved with their links, pairs and groups, and loaded again."""

    def of(self, title: str, patches: Iterable[str] | None = None) -> ContactSet:
        """Patches, all by default, as a set that is complete in itself.

        A patch whose parent is left out gets the root where it is now; pairs and groups come along where all their
        patches do.
        """
        document = self._document
        names = list(document.patches if patches is None else patches)
        chosen: dict[str, Patch] = {}
        owned: set[str] = set()
        for name in names:
            patch = document.patch(name)
            if isinstance(patch.placement, Link) and patch.placement.parent not in names:
                patch = replace(patch, placement=self._geometry.root(name))
            chosen[name] = patch
            owned |= {patch.shape} if patch.original else set()
        for name, patch in chosen.items():  # where the original stays behind, the first copy takes its part
            if patch.shape not in owned:
                owned.add(patch.shape)
                chosen[name] = replace(patch, original=True)
        surfaces = {patch.surface for patch in chosen.values()}
        return ContactSet(
            title,
            FrozenMap({name: document.surface(name) for name in document.surfaces if name in surfaces}),
            FrozenMap(chosen),
            FrozenMap({patch.shape: document.shapes[patch.shape] for patch in chosen.values()}),
            FrozenMap({n: p for n, p in document.pairs.items() if {p.manipulator, p.object} <= set(chosen)}),
            FrozenMap({n: members for n, members in document.groups.items() if set(members) <= set(chosen)}),
        )

    def write(self, path: Path | str, title: str, patches: Iterable[str] | None = None) -> ContactSet:
        """Save patches, all by default, with their links, pairs and groups. Raises FileRefused."""
        found = self.of(title, patches)
        save_contact_set(found, path)
        return found

    def read(
        self,
        source: ContactSet | Path | str,
        *,
        onto: Mapping[str, str] | None = None,
        roots: Mapping[str, Root] | None = None,
    ) -> dict[str, str]:
        """Load a set; returns the new names by the names in the set. Names that are taken get a number.

        onto: by surface of the set, the surface to load onto (the same name by default). Where that has the same
        topology, everything goes where it was. On another surface each patch that is no child needs an
        entry in `roots`, and its descendants follow by their links. Raises InvalidInput naming what is missing.
        """
        loaded = source if isinstance(source, ContactSet) else load_contact_set(source)
        names = self._fresh(loaded.patches, self._document.patches)
        keys = self._fresh(loaded.shapes, self._document.shapes)
        patches, missing = [], []
        for patch in loaded.parents_first():
            old = loaded.surfaces[patch.surface]
            new = self._document.surface((onto or {}).get(old.name, old.name))
            placement = patch.placement
            if isinstance(placement, Link):
                units = old.meters_per_unit / new.meters_per_unit
                placement = replace(placement.scaled(units), parent=names[placement.parent])
            elif roots is not None and patch.name in roots:
                placement = roots[patch.name]
            elif (new.topology_digest, _proxy(new)) != (old.topology_digest, _proxy(old)):
                missing.append(patch.name)
            name, key = names[patch.name], keys[patch.shape]
            patches.append(replace(patch, name=name, surface=new.name, shape=key, placement=placement))
        if missing:
            raise InvalidInput(
                f"the set {loaded.title!r} was painted on another mesh: give roots for {', '.join(missing)}."
            )
        pair_names = self._fresh(loaded.pairs, self._document.pairs)
        pairs = [
            replace(pair, name=pair_names[name], manipulator=names[pair.manipulator], object=names[pair.object])
            for name, pair in loaded.pairs.items()
        ]
        group_names = self._fresh(loaded.groups, self._document.groups)
        groups = {group_names[name]: tuple(names[m] for m in members) for name, members in loaded.groups.items()}
        shapes = {keys[key]: shape for key, shape in loaded.shapes.items()}
        self._editor.do(Import(tuple(patches), FrozenMap(shapes), tuple(pairs), FrozenMap(groups), loaded.title))
        return names

    def _fresh(self, wanted: Iterable[str], among: Mapping[str, object]) -> dict[str, str]:
        """By each wanted name the one that it gets, which nothing of the document has, nor any other of them."""
        taken, names = dict.fromkeys(among), {}
        for name in wanted:
            names[name] = self._document.free_name(name, taken)
            taken[names[name]] = None
        return names


def _proxy(surface: Surface) -> str | None:
    """The digest of a surface's proxy, whose faces its roots name."""
    return None if surface.proxy is None else surface.proxy.digest
