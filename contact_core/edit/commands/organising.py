"""Commands that pair, group, name and colour patches, bring some in, and keep other people's data."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from contact_core.contact.placement import Link
from contact_core.contact.shape import PatchShape
from contact_core.document.codec import freeze_json
from contact_core.document.document import Color, ContactDocument, ContactPair, Patch, check_name, named
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.command import BaseCommand, Command
from contact_core.edit.commands.checks import add_patches, check_free
from contact_core.edit.commands.timing import with_tracks_renamed, without_stray_time
from contact_core.errors import CommandRejected


@dataclass(frozen=True, eq=False)
class Pair(BaseCommand):
    """Two patches that are to touch; a pair of the same name is replaced (a new weight, other ends)."""

    json_id: ClassVar[str] = "contact.pair"
    pair: ContactPair

    def label(self) -> str:
        return f"Pair {self.pair.manipulator} with {self.pair.object}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        for end in (self.pair.manipulator, self.pair.object):
            document.patch(end)
        return replace(document, pairs=document.pairs.with_item(self.pair.name, self.pair))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, Pair) and later.pair.name == self.pair.name else None


@dataclass(frozen=True, eq=False)
class Unpair(BaseCommand):
    """A pair dissolved."""

    json_id: ClassVar[str] = "contact.unpair"
    pair: str

    def label(self) -> str:
        return f"Unpair {self.pair}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        named(document.pairs, self.pair, "pair")
        return without_stray_time(replace(document, pairs=document.pairs.without(self.pair)))


@dataclass(frozen=True, eq=False)
class Group(BaseCommand):
    """Patches kept as one, on whatever surfaces they lie; a group of the same name is replaced."""

    json_id: ClassVar[str] = "contact.group"
    name: str
    patches: tuple[str, ...]

    def label(self) -> str:
        return f"Group {self.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        check_name(self.name, "a group")
        if not self.patches or len(set(self.patches)) != len(self.patches):
            raise CommandRejected(f"the group {self.name!r} needs patches, each once.")
        for patch in self.patches:
            document.patch(patch)
        return replace(document, groups=document.groups.with_item(self.name, self.patches))


@dataclass(frozen=True, eq=False)
class Ungroup(BaseCommand):
    """A group dissolved; its patches stay."""

    json_id: ClassVar[str] = "contact.ungroup"
    name: str

    def label(self) -> str:
        return f"Ungroup {self.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        named(document.groups, self.name, "group")
        return replace(document, groups=document.groups.without(self.name))


@dataclass(frozen=True, eq=False)
class Rename(BaseCommand):
    """A new name for a patch, everywhere it is named."""

    json_id: ClassVar[str] = "contact.rename"
    patch: str
    name: str

    def label(self) -> str:
        return f"Rename {self.patch} to {self.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        check_free(document.patches, self.name, "patch")
        patches: dict[str, Patch] = {}
        for other in document.patches.values():  # in order, so that a list in a panel does not jump
            if isinstance(other.placement, Link) and other.placement.parent == patch.name:
                other = replace(other, placement=replace(other.placement, parent=self.name))
            renamed = replace(other, name=self.name) if other.name == patch.name else other
            patches[renamed.name] = renamed

        def new(name: str) -> str:
            return self.name if name == patch.name else name

        pairs = {
            pair.name: replace(pair, manipulator=new(pair.manipulator), object=new(pair.object))
            for pair in document.pairs.values()
        }
        groups = {name: tuple(new(member) for member in members) for name, members in document.groups.items()}
        document = with_tracks_renamed(document, ("placement",), new)
        return replace(
            document, patches=FrozenMap(patches), pairs=FrozenMap(pairs), groups=FrozenMap(groups)
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Recolor(BaseCommand):
    """A colour (RGB 0..1) for patches."""

    json_id: ClassVar[str] = "contact.recolor"
    patches: tuple[str, ...]
    color: Color

    def label(self) -> str:
        return f"Colour {', '.join(self.patches)}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        return document.with_patches(*(replace(document.patch(name), color=self.color) for name in self.patches))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, Recolor) and later.patches == self.patches else None


@dataclass(frozen=True, eq=False)
class Import(BaseCommand):
    """Patches from a contact set or another document, parents before children, with their shapes and pairs."""

    json_id: ClassVar[str] = "contact.import"
    patches: tuple[Patch, ...]
    shapes: FrozenMap[PatchShape]
    pairs: tuple[ContactPair, ...] = ()
    groups: FrozenMap[tuple[str, ...]] = field(default_factory=FrozenMap)
    title: str = "contacts"

    def label(self) -> str:
        return f"Import {self.title}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        for key in self.shapes:
            check_free(document.shapes, key, "shape")
        unused = set(self.shapes) - {patch.shape for patch in self.patches}
        if unused:
            raise CommandRejected(f"the shape {sorted(unused)[0]!r} belongs to no patch of the import.")
        document = replace(document, shapes=document.shapes.updated(self.shapes))
        document = add_patches(document, self.patches)
        for pair in self.pairs:
            check_free(document.pairs, pair.name, "pair")
            document = Pair(pair).apply(document)
        for name, members in self.groups.items():
            check_free(document.groups, name, "group")
            document = Group(name, members).apply(document)
        return document


@dataclass(frozen=True, eq=False)
class SetExtra(BaseCommand):
    """JSON data of a host or a plugin under its namespace; None removes it."""

    json_id: ClassVar[str] = "document.extra"
    namespace: str
    value: Any

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", freeze_json(self.value))

    def label(self) -> str:
        return f"Set {self.namespace}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        check_name(self.namespace, "a namespace")
        if self.value is None:
            return replace(document, extras=document.extras.without(self.namespace))
        return replace(document, extras=document.extras.with_item(self.namespace, self.value))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, SetExtra) and later.namespace == self.namespace else None
