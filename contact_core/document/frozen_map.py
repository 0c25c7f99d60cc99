"""An immutable mapping with cheap changed copies: what the document is made of.

`types.MappingProxyType` can be neither pickled nor deep-copied, and does not protect the dict beneath it.
"""

from __future__ import annotations

from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping, ValuesView
from typing import Any, Generic, TypeVar

V = TypeVar("V")


class FrozenMap(Mapping[str, V], Generic[V]):
    """A read-only mapping from names to values; `with_item`, `without` and `updated` answer changed copies."""

    __slots__ = ("_items",)
    _items: dict[str, V]

    def __init__(self, items: Mapping[str, V] | Iterable[tuple[str, V]] = ()) -> None:
        self._items = dict(items)

    def __getitem__(self, name: str) -> V:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __contains__(self, name: object) -> bool:
        return name in self._items

    # Views of the dict itself: those of Mapping ask for each key in Python, and edits scan thousands of patches.
    def keys(self) -> KeysView[str]:
        return self._items.keys()

    def values(self) -> ValuesView[V]:
        return self._items.values()

    def items(self) -> ItemsView[str, V]:
        return self._items.items()

    def __repr__(self) -> str:
        return f"FrozenMap({self._items!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        return (FrozenMap, (dict(self._items),))

    def with_item(self, name: str, value: V) -> FrozenMap[V]:
        """A copy in which `name` is `value`."""
        return FrozenMap(self._items | {name: value})

    def updated(self, items: Mapping[str, V]) -> FrozenMap[V]:
        """A copy with all `items` put in."""
        return FrozenMap(self._items | dict(items)) if items else self

    def without(self, *names: str) -> FrozenMap[V]:
        """A copy without `names`; those absent are no error."""
        gone = set(names)
        return FrozenMap({name: value for name, value in self._items.items() if name not in gone})
