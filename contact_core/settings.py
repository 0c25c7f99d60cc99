"""Settings that declare themselves: brushes, axis generators, placers, solvers, terms, and whatever a panel shows.

A thing with settings is a frozen dataclass that derives from `HasSettings`; each setting is a field made by
`setting`, which carries unit, range and help beside the default. From this every host builds its panel, and every
value is checked before use, with a sentence. Fields without `setting` are data that a program gives (pins, solids);
no panel shows them.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Integral, Real
from typing import Any, Literal, TypeAlias, TypeVar, Union, overload

from contact_core.errors import InvalidInput, quoted

T = TypeVar("T")
Kind: TypeAlias = Literal["number", "count", "flag", "text", "choice", "vector", "texts", "numbers"]
_KEY = "contact setting"  # of a dataclass field's metadata
_KINDS: dict[Any, Kind] = {
    float: "number",
    int: "count",
    bool: "flag",
    str: "text",
    tuple[float, float, float]: "vector",
    tuple[str, ...]: "texts",
    tuple[float, ...]: "numbers",
}
_SPELT: dict[Kind, str] = {
    "number": "a number",
    "count": "a whole number",
    "flag": "true or false",
    "text": "a text",
    "choice": "a text",
    "vector": "three numbers",
    "texts": "a list of texts",
    "numbers": "a list of numbers",
}


@dataclass(frozen=True)
class _Declared:
    """What `setting` notes beside a field."""

    help: str
    unit: str
    low: float | None
    high: float | None
    above: float | None
    choices: tuple[str, ...]


@dataclass(frozen=True)
class Setting:
    """One setting as a panel needs it.

    kind: what its values are. optional: whether None is a value too, "decide for me". unit: "" where it has none.
    low, high: the range of numbers, both within it; above: a bound outside it. choices: the texts to choose from.
    """

    name: str
    kind: Kind
    default: Any
    help: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    choices: tuple[str, ...] = ()
    optional: bool = False

    def checked(self, value: Any) -> Any:
        """The value as the setting holds it (a list becomes a tuple). Raises InvalidInput with a sentence."""
        if value is None and self.optional:
            return None
        if not self._is_of_kind(value):
            raise InvalidInput(f"{self.name} is {_SPELT[self.kind]}, but got {quoted(value)}.")
        parts = list(value) if isinstance(value, (list, tuple)) else [value]
        if self.kind in ("number", "vector", "numbers"):
            parts = [float(part) for part in parts]
        elif self.kind == "count":
            parts = [int(value)]
        for part in parts:
            self._check_range(part)
        return tuple(parts) if self.kind in ("vector", "texts", "numbers") else parts[0]

    def _is_of_kind(self, value: Any) -> bool:
        if self.kind == "flag":
            return isinstance(value, bool)
        if self.kind in ("text", "choice"):
            return isinstance(value, str)
        if self.kind in ("number", "count"):
            return _is_number(value) and (self.kind == "number" or isinstance(value, Integral))
        if not isinstance(value, (list, tuple)) or (self.kind == "vector" and len(value) != 3):
            return False
        return all(isinstance(part, str) if self.kind == "texts" else _is_number(part) for part in value)

    def _check_range(self, part: Any) -> None:
        if self.choices and part not in self.choices:
            raise InvalidInput(f"{self.name} is one of {', '.join(self.choices)}, but got {part!r}.")
        if isinstance(part, (str, bool)):
            return
        if not math.isfinite(part):
            raise InvalidInput(f"{self.name} is finite, but got {part}.")
        unit = f" {self.unit}" if self.unit else ""
        if self.above is not None and part <= self.above:
            raise InvalidInput(f"{self.name} is above {self.above:g}{unit}, but got {part:g}.")
        if self.low is not None and part < self.low:
            raise InvalidInput(f"{self.name} is at least {self.low:g}{unit}, but got {part:g}.")
        if self.high is not None and part > self.high:
            raise InvalidInput(f"{self.name} is at most {self.high:g}{unit}, but got {part:g}.")


def setting(
    default: Any,
    *,
    help: str,  # noqa: A002  (what it is called everywhere)
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A field of a frozen dataclass that is a setting. Its annotation says what its values are: float, int, bool,
    str, tuple[float, float, float], tuple[float, ...], tuple[str, ...], a Literal of texts; each also `| None`.

    help: a sentence for the artist. unit: such as "degrees" or "manipulator lengths". low, high: the least and the
    largest value; above: a bound that is no value itself. choices: for texts.
    """
    declared = _Declared(help, unit, low, high, above, choices)
    return field(default=default, metadata={_KEY: declared})


class HasSettings:
    """Base of frozen dataclasses with settings: no instance holds a value that its settings refuse."""

    def __post_init__(self) -> None:
        for each in settings_of(self):
            try:
                object.__setattr__(self, each.name, each.checked(getattr(self, each.name)))
            except InvalidInput as error:
                raise InvalidInput(f"{_name_of(self)}: {error}") from None


def settings_of(thing: object) -> tuple[Setting, ...]:
    """The settings of a class, with its defaults, or of an object, whose own values are the defaults then.

    Raises InvalidInput where a declaration is wrong: a type that no setting can have.
    """
    if not dataclasses.is_dataclass(thing):
        return ()
    found = []
    for item in dataclasses.fields(thing):
        declared: _Declared | None = item.metadata.get(_KEY)
        if declared is not None:
            kind, choices, optional = _kind_of(thing if isinstance(thing, type) else type(thing), item.name)
            default = item.default if isinstance(thing, type) else getattr(thing, item.name)
            found.append(
                Setting(
                    item.name, kind, default, declared.help, declared.unit, declared.low, declared.high,
                    declared.above, declared.choices or choices, optional,
                )
            )  # fmt: skip
    return tuple(found)


@overload
def configured(thing: type[T], given: Mapping[str, Any], who: str) -> T: ...
@overload
def configured(thing: T, given: Mapping[str, Any], who: str) -> T: ...
def configured(thing: Any, given: Mapping[str, Any], who: str) -> Any:
    """An object of a class, or another like an object, with the settings and data that are given by name.

    who: how to call it in sentences, "the brush 'disk'". Raises InvalidInput for a name that it does not have and a
    value that its setting refuses.
    """
    known = {each.name: each for each in settings_of(thing)}
    names = [*known, *(name for name in _data_names(thing) if name not in known)]
    values = {}
    for name, value in given.items():
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"its settings: {', '.join(known) or 'none'}."
            raise InvalidInput(f"{who} has no setting {name!r}; {hint}")
        try:
            values[name] = known[name].checked(value) if name in known else value
        except InvalidInput as error:
            raise InvalidInput(f"{who}: {error}") from None
    if isinstance(thing, type):
        return thing(**values)
    return dataclasses.replace(thing, **values) if values else thing


def declaration_mistakes(thing: object) -> list[str]:
    """What is wrong with how a thing declares its settings, in words; empty when nothing is."""
    try:
        settings = settings_of(thing)
    except InvalidInput as error:
        return [str(error)]
    mistakes = []
    kind = thing if isinstance(thing, type) else type(thing)
    if settings and not is_frozen_dataclass(kind):
        mistakes.append("declares settings and is no frozen dataclass")
    if settings and not issubclass(kind, HasSettings):
        mistakes.append("declares settings and does not derive from HasSettings, which checks them")
    for each in settings:
        if len(each.help.split()) < 3:
            mistakes.append(f"its setting {each.name!r} needs a help of three words or more")
        try:
            each.checked(each.default)
        except InvalidInput as error:
            mistakes.append(f"refuses its own default: {str(error).rstrip('.')}")
    return mistakes


def is_frozen_dataclass(candidate: object) -> bool:
    """Whether this is a class of values that do not change."""
    parameters = getattr(candidate, "__dataclass_params__", None)
    return isinstance(candidate, type) and parameters is not None and parameters.frozen


def _data_names(thing: object) -> list[str]:
    return [item.name for item in dataclasses.fields(thing) if item.init] if dataclasses.is_dataclass(thing) else []


def _kind_of(owner: type, name: str) -> tuple[Kind, tuple[str, ...], bool]:
    """What values a field has: kind, choices, whether None is one. Only its own annotation is resolved: those of
    data may name what is imported for type checkers alone."""
    base = next(each for each in owner.__mro__ if name in vars(each).get("__annotations__", {}))
    alone = type("_", (), {"__annotations__": {name: base.__annotations__[name]}, "__module__": base.__module__})
    try:
        annotation = typing.get_type_hints(alone)[name]
    except NameError as error:
        raise InvalidInput(
            f"the setting {name!r} of {owner.__name__} is annotated {base.__annotations__[name]}, but its module"
            f" knows no {error.name!r} while it runs."
        ) from error
    optional = False
    if typing.get_origin(annotation) in (Union, types.UnionType):
        optional = type(None) in typing.get_args(annotation)
        rest = [part for part in typing.get_args(annotation) if part is not type(None)]
        annotation = rest[0] if len(rest) == 1 else annotation
    if typing.get_origin(annotation) is Literal:
        choices = typing.get_args(annotation)
        if all(isinstance(choice, str) for choice in choices):
            return "choice", choices, optional
    if annotation not in _KINDS:
        raise InvalidInput(
            f"the setting {name!r} of {owner.__name__} is annotated {annotation}; a setting is one of float, int,"
            " bool, str, tuple[float, float, float], tuple[float, ...], tuple[str, ...], a Literal of texts, each"
            " also with None."
        )
    return _KINDS[annotation], (), optional


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _name_of(thing: object) -> str:
    name = getattr(thing, "name", None)
    return name if isinstance(name, str) else type(thing).__name__
