"""A strict reader of parsed TOML tables: every mistake is a sentence, no key is ignored."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar, overload

from contact_core.errors import InvalidInput, quoted

T = TypeVar("T")
Vector = tuple[float, float, float]
_REQUIRED: Any = object()
LARGEST = 1e30  # of any number: what is larger overflows once it is squared
SMALLEST = 1e-30  # of a direction's largest part: what is smaller vanishes once it is squared


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """The values in TOML text. Raises InvalidInput that begins with `name`, whatever is wrong with the text."""
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))  # Windows editors begin their files so
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(f"{name} is not TOML: {error}.") from error
    except RecursionError as error:
        raise InvalidInput(f"{name} is nested too deeply.") from error
    except ValueError as error:  # Python itself refuses whole numbers of thousands of digits
        raise InvalidInput(f"{name} holds a number of more digits than any that is meant.") from error


class Table:
    """One table of a file. `where` spells it in messages; `done` refuses what nobody asked for."""

    def __init__(self, values: Any, where: str) -> None:
        if not isinstance(values, Mapping):
            raise InvalidInput(f"{where} must be a table, but got {quoted(values)}.")
        self.values, self.where = values, where
        self._asked: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def done(self) -> None:
        """Raises InvalidInput when a key is left that was never asked for."""
        for key in self.values:
            if key not in self._asked:
                near = difflib.get_close_matches(str(key), self._asked, n=1)
                hint = f"did you mean {near[0]!r}?" if near else f"it knows {', '.join(sorted(self._asked))}."
                raise InvalidInput(f"{self.where} has no key {quoted(key)}; {hint}")

    def raw(self, key: str, default: Any = _REQUIRED) -> Any:
        """A value of any kind."""
        self._asked.add(key)
        if key in self.values:
            return self.values[key]
        if default is _REQUIRED:
            raise InvalidInput(f"{self.where} needs {key!r}.")
        return default

    @overload
    def text(self, key: str) -> str: ...
    @overload
    def text(self, key: str, default: T) -> str | T: ...
    def text(self, key: str, default: Any = _REQUIRED) -> Any:
        """A non-empty string."""
        return self._checked(key, default, "a text", lambda v: isinstance(v, str) and 0 < len(v) <= 10_000)

    def choice(self, key: str, choices: Sequence[str], default: Any = _REQUIRED) -> str:
        """One of some words."""
        return str(self._checked(key, default, f"one of {', '.join(map(repr, choices))}", lambda v: v in choices))

    def flag(self, key: str, default: bool) -> bool:
        """true or false."""
        return bool(self._checked(key, default, "true or false", lambda v: isinstance(v, bool)))

    @overload
    def number(self, key: str, *, above: float = ..., at_least: float = ..., at_most: float = ...) -> float: ...
    @overload
    def number(
        self, key: str, default: T, *, above: float = ..., at_least: float = ..., at_most: float = ...
    ) -> float | T: ...
    def number(
        self, key: str, default: Any = _REQUIRED, *, above: float = -math.inf, at_least: float = -math.inf,
        at_most: float = math.inf,
    ) -> Any:  # fmt: skip
        """A finite number within bounds."""
        bounds = [f"above {above:g}"] * (above > -math.inf) + [f"at least {at_least:g}"] * (at_least > -math.inf)
        bounds += [f"at most {at_most:g}"] * (at_most < math.inf)
        wanted = " ".join(["a number", " and ".join(bounds)]).strip()
        value = self._checked(
            key, default, wanted, lambda v: _is_number(v) and v > above and at_least <= v <= at_most
        )
        return float(value) if _is_number(value) else value

    def count(self, key: str, default: Any = _REQUIRED, *, at_least: int = 0, at_most: int = 1_000_000) -> int:
        """A whole number within bounds."""
        wanted = f"a whole number from {at_least} to {at_most}"
        return int(self._checked(key, default, wanted, lambda v: type(v) is int and at_least <= v <= at_most))

    def vector(self, key: str, default: Any = _REQUIRED, *, direction: bool = False) -> Any:
        """Three finite numbers as a tuple; a direction is not zero."""
        wanted = "three numbers" + (", not all zero" if direction else "")
        value = self._checked(
            key, default, wanted, lambda v: _is_vector(v) and (not direction or max(map(abs, v)) >= SMALLEST)
        )
        return tuple(float(x) for x in value) if isinstance(value, list) else value

    def vectors(self, key: str, default: Any = _REQUIRED) -> tuple[Vector, ...]:
        """A list of rows of three finite numbers."""
        value = self._checked(
            key, default, "a list of [x, y, z]", lambda v: _is_list(v, 100_000) and all(map(_is_vector, v))
        )
        return tuple((float(x), float(y), float(z)) for x, y, z in value)

    def texts(self, key: str, default: Any = _REQUIRED) -> tuple[str, ...]:
        """A list of non-empty strings; a single string counts as a list of one."""
        if isinstance(self.values.get(key), str):
            return (str(self.text(key)),)
        value = self._checked(
            key,
            default,
            "a list of texts",
            lambda v: _is_list(v, 1000) and all(isinstance(t, str) and t for t in v),
        )
        return tuple(value)

    def counts(self, key: str, default: Any = _REQUIRED) -> tuple[int, ...]:
        """A list of whole numbers, none negative."""
        return tuple(self._checked(key, default, "a list of whole numbers", _is_counts))

    def table(self, key: str, default: Any = _REQUIRED) -> Table:
        """A table inside this one."""
        value = self.raw(key, {} if default is None else default)
        return Table(value, f"{self.where}.{key}")

    def tables(self, key: str) -> Iterator[Table]:
        """The tables of a list `[[key]]`, of which there is at least one."""
        value = self.raw(key)
        if not _is_list(value, 1000) or not value:
            raise InvalidInput(f"{self.where}.{key} must be a list of tables, [[{key}]], but got {quoted(value)}.")
        yield from (Table(item, f"{self.where}.{key}[{place}]") for place, item in enumerate(value))

    def one_or_more(self, key: str) -> Iterator[Table]:
        """The one table [key], or the tables of a list [[key]]."""
        if isinstance(self.values.get(key), list):
            yield from self.tables(key)
        else:
            yield self.table(key)

    def exactly_one(self, *keys: str) -> str:
        """The one of some keys that is there; raises InvalidInput unless it is exactly one."""
        self._asked.update(keys)
        there = [key for key in keys if key in self.values]
        if len(there) != 1:
            got = " and ".join(map(repr, there)) or "none"
            raise InvalidInput(f"{self.where} needs exactly one of {', '.join(map(repr, keys))}, but got {got}.")
        return there[0]

    def _checked(self, key: str, default: Any, wanted: str, fits: Any) -> Any:
        value = self.raw(key, default)
        if key in self.values and not fits(value):
            raise InvalidInput(f"{self.where}.{key} must be {wanted}, but got {quoted(value)}.")
        return value


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST  # nan, inf and 10**400 are not


def _is_vector(value: Any) -> bool:
    return _is_list(value, 3) and len(value) == 3 and all(map(_is_number, value))


def _is_list(value: Any, longest: int) -> bool:
    return isinstance(value, list) and len(value) <= longest


def _is_counts(value: Any) -> bool:
    return _is_list(value, 1_000_000) and all(type(item) is int and 0 <= item < 2**62 for item in value)
