"""Locks: patches that no tool may change. They are of the desk, as what is hidden is, and never of the document."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from contact_core.document.document import ContactDocument, Patch
from contact_core.errors import CommandRejected

Kind: TypeAlias = Literal["surface", "patch"]


@dataclass(frozen=True)
class Locks:
    """What is locked, by name. A surface stands for every patch on it, and takes no new one."""

    surfaces: frozenset[str] = frozenset()
    patches: frozenset[str] = frozenset()

    def turned(self, kind: Kind, name: str) -> Locks:
        """With one more locked, or that one unlocked."""
        if kind == "surface":
            return Locks(self.surfaces ^ {name}, self.patches)
        return Locks(self.surfaces, self.patches ^ {name})

    def renamed(self, patch: str, name: str) -> Locks:
        """The lock of a patch under its other name."""
        return self.turned("patch", patch).turned("patch", name) if patch in self.patches else self

    def holds(self, patch: Patch) -> bool:
        """Whether a patch is locked, by itself or by its surface."""
        return patch.name in self.patches or patch.surface in self.surfaces

    def check(self, before: ContactDocument, after: ContactDocument) -> None:
        """Raises CommandRejected where a locked patch is not as it was: itself, its shape, its ancestors."""
        if before is after or not (self.surfaces or self.patches):
            return
        for patch in before.patches.values():
            if self.holds(patch) and not _same(before, after, patch.name):
                raise CommandRejected(_locked(patch, self))
        for patch in after.patches.values():
            if patch.name not in before.patches:
                self.check_surface(patch.surface)

    def check_patches(self, document: ContactDocument, names: Iterable[str], *, reaching: bool = False) -> None:
        """Raises CommandRejected where one of these patches is locked. reaching: what changes them also changes
        the patches that share their shapes, and the children of all those."""
        meant = set(names)
        if reaching:
            meant |= {other for name in meant for other in document.partners(name)}
            meant |= {name for name in document.patches if meant & set(document.ancestors(name))}
        for patch in document.patches.values():
            if patch.name in meant and self.holds(patch):
                raise CommandRejected(_locked(patch, self))

    def check_surface(self, surface: str) -> None:
        """Raises CommandRejected where a surface takes no new patch."""
        if surface in self.surfaces:
            raise CommandRejected(f"the patches of {surface} are locked: unlock it in the tree.")


def _locked(patch: Patch, locks: Locks) -> str:
    where = "" if patch.name in locks.patches else f" with all patches of {patch.surface}"
    return f"{patch.name} is locked{where}: unlock it in the tree."


def _same(before: ContactDocument, after: ContactDocument, name: str) -> bool:
    """Whether a patch lies as it did and has its shape. Commands replace what they change, so what is the same
    object did not change; a name or a colour moves nothing."""
    chains = [[name, *document.ancestors(name)] if name in document.patches else [] for document in (before, after)]
    if chains[0] != chains[1]:
        return False
    return all(
        before.shapes[one.shape] is after.shapes[other.shape]
        and one.placement is other.placement
        and _numbers(one) == _numbers(other)
        for one, other in ((before.patch(each), after.patch(each)) for each in chains[0])
    )


def _numbers(patch: Patch) -> tuple[object, ...]:
    return patch.surface, patch.mirrored, patch.turns, patch.along, patch.spread
