"""Values to JSON and back, driven by the annotations of frozen dataclasses.

One codec for documents, commands and contact sets, so that a value which can be built can be stored. Arrays
become lists, complex numbers [real, imaginary]; classes that come in unions (`json_union`) carry a key "is".
No NaN, no infinity, no code: what does not fit its annotation is refused in words with the place in the file.
"""

from __future__ import annotations

import dataclasses
import gc
import json
import math
import types
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial
from itertools import chain
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from contact_core.arrays import all_finite
from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import ContactError, FileRefused, quoted, shortened

MAX_ARRAY = 50_000_000  # numbers in one array: beyond any patch, below any memory bomb
MAX_DEPTH = 100  # levels of free JSON data: writing and reading go a few calls deep for each
ROW = 12  # numbers on a line of the written file
_NUMBERS = {int, float}
_dump = json.JSONEncoder(allow_nan=False).encode  # json.dumps makes an encoder for each call


def to_json(value: Any, annotation: Any = Any) -> Any:
    """JSON-able data of a value; `annotation` settles what 1 means (1.0 where a float belongs)."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if annotation is float or annotation is int:
        return annotation(value)
    if annotation is complex or isinstance(value, complex):
        number = complex(value)
        return [number.real, number.imag]
    if isinstance(value, (int, float)):
        return value
    if isinstance(value, np.ndarray):
        return _array_to_json(value)
    if isinstance(value, Mapping):
        item_type = get_args(annotation)[0] if get_origin(annotation) is FrozenMap else Any
        return {name: to_json(item, item_type) for name, item in value.items()}
    if isinstance(value, (tuple, list)):
        types_of_items = _item_types(annotation, len(value))
        return [to_json(item, item_type) for item, item_type in zip(value, types_of_items, strict=True)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        tag = {"is": type(value).__name__} if getattr(value, "json_union", False) else {}
        hints = _hints(type(value))
        return tag | {name: to_json(getattr(value, name), hints[name]) for name in _fields(type(value))}
    raise TypeError(f"{type(value).__name__} has no JSON form.")


def from_json(annotation: Any, data: Any, where: str = "value") -> Any:
    """The value of `annotation` that `data` stands for. Raises FileRefused naming the place that does not fit."""
    try:
        return _decode(annotation, data, where)
    except FileRefused:
        raise
    except (ContactError, ValueError, TypeError, OverflowError) as error:
        raise FileRefused(f"{where} does not fit: {shortened(str(error))}") from error


def freeze_json(data: Any, depth: int = 0) -> Any:
    """JSON data as an immutable value: objects become FrozenMap, lists tuples. Raises FileRefused.

    Whole numbers of 64 bits and MAX_DEPTH levels, so that whatever can be held can be written and read again.
    """
    if data is None or isinstance(data, (bool, str)):
        return data
    if isinstance(data, int):
        if not -(1 << 63) <= data < 1 << 63:
            raise FileRefused("JSON data holds whole numbers of at most 64 bits, but got a larger one.")
        return data
    if isinstance(data, float):
        return _finite(data, "JSON data")
    if depth >= MAX_DEPTH:
        raise FileRefused(f"JSON data holds at most {MAX_DEPTH} levels of lists and objects, but got more.")
    if isinstance(data, Mapping):
        return FrozenMap({_text(key, "a key"): freeze_json(item, depth + 1) for key, item in data.items()})
    if isinstance(data, (list, tuple)):
        return tuple(freeze_json(item, depth + 1) for item in data)
    raise FileRefused(f"JSON data holds numbers, texts, lists and objects, but got {type(data).__name__}.")


class Fragment(str):
    """JSON text that `pretty` puts in as it is."""


def pretty(data: Any, indent: int = 0) -> str:
    """Deterministic JSON text for review: sorted keys, one item a line, numbers in rows."""
    pad = " " * (indent + 1)
    if isinstance(data, Fragment):
        return data
    if isinstance(data, dict) and data:
        lines = [f"{pad}{json.dumps(key)}: {pretty(data[key], indent + 1)}" for key in sorted(data)]
        return "{\n" + ",\n".join(lines) + "\n" + " " * indent + "}"
    if isinstance(data, list) and data and isinstance(data[0], (list, dict)):
        if all(_is_row(item) for item in data):
            return _rows(data, pad, indent)
        if all(isinstance(item, list) and all(_is_row(row) for row in item) for item in data):  # matrices
            return _rows(data, pad, indent, 1)
        return "[\n" + ",\n".join(pad + pretty(item, indent + 1) for item in data) + "\n" + " " * indent + "]"
    if isinstance(data, list) and len(data) > ROW:
        return _rows(data, pad, indent)
    return _dump(data)


def _is_row(item: Any) -> bool:
    """Whether data are a point, a face or a row of a matrix."""
    return isinstance(item, list) and len(item) <= 4 and not any(isinstance(x, (list, dict)) for x in item)


def _rows(data: list[Any], pad: str, indent: int, per_line: int = ROW) -> str:
    starts = range(0, len(data), per_line)
    if _NUMBERS.issuperset(map(type, data)):  # encoded at once: a call of the encoder costs more than a row
        numbers = _dump(data)[1:-1].split(", ")
        rows = [", ".join(numbers[k : k + per_line]) for k in starts]
    else:
        rows = [_dump(data[k : k + per_line])[1:-1] for k in starts]
    return "[\n" + ",\n".join(pad + row for row in rows) + "\n" + " " * indent + "]"


def _array_to_json(array: np.ndarray[Any, Any]) -> Any:
    if np.iscomplexobj(array):
        return np.stack([array.real, array.imag], -1).tolist()
    return array.tolist()


def _item_types(annotation: Any, count: int) -> Sequence[Any]:
    """The annotation of each of `count` items of a tuple."""
    items = get_args(annotation) if get_origin(annotation) is tuple else ()
    if len(items) == 2 and items[1] is Ellipsis:
        return [items[0]] * count
    return items if len(items) == count else [Any] * count


@contextmanager
def without_collector() -> Iterator[None]:
    """Let Python's collector of cycles rest: values and their JSON have none, and looking costs a third of the
    time in which many are made."""
    works = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if works:
            gc.enable()


@cache
def _hints(cls: type) -> dict[str, Any]:
    return get_type_hints(cls)


@cache
def _fields(cls: type) -> tuple[str, ...]:
    return tuple(item.name for item in dataclasses.fields(cls))


def _members(annotation: Any) -> list[Any]:
    """The dataclasses of a union."""
    if get_origin(annotation) not in (Union, types.UnionType):
        return []
    return [member for member in get_args(annotation) if dataclasses.is_dataclass(member)]


def _unaliased(annotation: Any) -> Any:
    """The type behind an alias with parameters: from numpy 2.5 on, NDArray[...] is one (PEP 695)."""
    value = getattr(get_origin(annotation), "__value__", None)
    return annotation if value is None else value[get_args(annotation)]


Decoder = Callable[[Any, str], Any]


def _decode(annotation: Any, data: Any, where: str) -> Any:
    return _decoder(annotation)(data, where)


@cache
def _decoder(annotation: Any) -> Decoder:
    """What decodes data of an annotation: looked into once, for a document has a hundred values a patch."""
    annotation = _unaliased(annotation)
    origin = get_origin(annotation)
    if origin in (Union, types.UnionType):
        return _union_decoder(annotation)
    if origin is Literal:
        return partial(_decode_literal, get_args(annotation))
    if origin is FrozenMap:
        return partial(_decode_map, _decoder(get_args(annotation)[0]))
    if origin is tuple:
        return _tuple_decoder(get_args(annotation))
    if origin is np.ndarray:
        return partial(_decode_array, np.dtype(get_args(get_args(annotation)[1])[0]))
    if annotation is Any:
        return lambda data, where: freeze_json(data)
    if dataclasses.is_dataclass(annotation) and isinstance(annotation, type):
        return partial(_decode_dataclass, annotation)
    return _decode_float if annotation is float else partial(_decode_scalar, annotation)


def _decode_literal(choices: tuple[Any, ...], data: Any, where: str) -> Any:
    if data not in choices:
        raise FileRefused(f"{where} is one of {choices}, but got {quoted(data)}.")
    return data


def _decode_map(item: Decoder, data: Any, where: str) -> FrozenMap[Any]:
    return FrozenMap({key: item(value, f"{where}.{key}") for key, value in _object(data, where).items()})


def _decode_float(data: Any, where: str) -> float:
    if type(data) is float and math.isfinite(data):
        return data
    return float(_decode_scalar(float, data, where))


def _decode_scalar(annotation: Any, data: Any, where: str) -> Any:
    if annotation is bool and isinstance(data, bool):
        return data
    if annotation is str:
        return _text(data, where)
    if annotation is int and isinstance(data, int) and not isinstance(data, bool):
        return data
    if annotation is float and isinstance(data, (int, float)) and not isinstance(data, bool):
        return _finite(float(data), where)
    if annotation is complex and isinstance(data, list) and len(data) == 2:
        return complex(_finite(float(data[0]), where), _finite(float(data[1]), where))
    raise FileRefused(f"{where} wants {getattr(annotation, '__name__', annotation)}, but got {quoted(data)}.")


def _union_decoder(annotation: Any) -> Decoder:
    """Of an optional value, or of dataclasses that say which one they are."""
    members = _members(annotation)
    optional = type(None) in get_args(annotation)
    if len(members) > 1:
        decoders: Mapping[Any, Decoder] = {member.__name__: _decoder(member) for member in members}
        several = partial(_decode_tagged, decoders)
        return partial(_decode_optional, several) if optional else several
    (only,) = [member for member in get_args(annotation) if member is not type(None)]
    return partial(_decode_optional, _decoder(only))


def _decode_optional(item: Decoder, data: Any, where: str) -> Any:
    return None if data is None else item(data, where)


def _decode_tagged(members: Mapping[Any, Decoder], data: Any, where: str) -> Any:
    kind = _object(data, where).get("is")
    if isinstance(kind, str) and kind in members:
        return members[kind](data, where)
    raise FileRefused(f'{where} needs a key "is" that is one of {", ".join(members)}, but got {quoted(kind)}.')


def _tuple_decoder(item_types: tuple[Any, ...]) -> Decoder:
    if len(item_types) == 2 and item_types[1] is Ellipsis:
        return partial(_decode_items, _decoder(item_types[0]))
    return partial(_decode_tuple, tuple(map(_decoder, item_types)))


def _decode_items(item: Decoder, data: Any, where: str) -> tuple[Any, ...]:
    return tuple(item(value, f"{where}[{k}]") for k, value in enumerate(_list(data, where)))


def _decode_tuple(items: tuple[Decoder, ...], data: Any, where: str) -> tuple[Any, ...]:
    if len(_list(data, where)) != len(items):
        raise FileRefused(f"{where} wants {len(items)} items, but got {len(data)}.")
    return tuple(item(value, f"{where}[{k}]") for k, (item, value) in enumerate(zip(items, data, strict=True)))


def _decode_array(dtype: np.dtype[Any], data: Any, where: str) -> np.ndarray[Any, Any]:
    if not isinstance(data, list) or len(data) > MAX_ARRAY:
        raise FileRefused(f"{where} wants a list of numbers, but got {quoted(data)}.")
    raw = _pairs(data, where) if dtype.kind == "c" else np.array(data)
    if raw.dtype.kind not in "biuf" or not all_finite(raw):
        raise FileRefused(f"{where} wants finite numbers.")
    if dtype.kind in "iu" and raw.size and raw.dtype.kind not in "iu":
        raise FileRefused(f"{where} wants whole numbers.")
    array = raw.view(dtype) if dtype.kind == "c" else np.ascontiguousarray(raw, dtype)
    array.setflags(write=False)
    return array


def _pairs(data: list[Any], where: str) -> np.ndarray[Any, Any]:
    """(2 n,) the numbers of a list of n pairs: an array of nested lists costs three times as much."""
    if not (set(map(type, data)) <= {list} and set(map(len, data)) <= {2}):
        raise FileRefused(f"{where} wants pairs of numbers.")
    flat = np.array(list(chain.from_iterable(data)))
    return flat if flat.dtype == np.float64 or flat.dtype.kind not in "biuf" else flat.astype(np.float64)


def _decode_dataclass(cls: type, data: Any, where: str) -> Any:
    items = _object(data, where)
    if getattr(cls, "json_union", False):
        items = dict(items)
        if items.pop("is", cls.__name__) != cls.__name__:
            raise FileRefused(f"{where} wants a {cls.__name__}.")
    fields = _field_decoders(cls)
    if not items.keys() <= fields.keys():
        unknown = min(items.keys() - fields.keys())
        raise FileRefused(f"{where} has no field {quoted(unknown)}; it has {', '.join(fields)}.")
    values = {}
    for name, (decoder, needed) in fields.items():
        if name in items:
            values[name] = decoder(items[name], f"{where}.{name}")
        elif needed:
            raise FileRefused(f"{where} lacks the field {name!r}.")
    try:
        return cls(**values)
    except ContactError as error:
        raise FileRefused(f"{where} does not fit: {shortened(str(error))}") from error


@cache
def _field_decoders(cls: type) -> Mapping[str, tuple[Decoder, bool]]:
    """The decoder of each field of a dataclass, and whether it has to be there."""
    missing = dataclasses.MISSING
    return {
        item.name: (_decoder(_hints(cls)[item.name]), item.default is missing and item.default_factory is missing)
        for item in dataclasses.fields(cls)
    }


def _object(data: Any, where: str) -> Mapping[str, Any]:
    if type(data) is not dict and not isinstance(data, Mapping):
        raise FileRefused(f"{where} wants an object, but got {quoted(data)}.")
    return typing.cast("Mapping[str, Any]", data)


def _list(data: Any, where: str) -> Sequence[Any]:
    if not isinstance(data, (list, tuple)) or len(data) > MAX_ARRAY:
        raise FileRefused(f"{where} wants a list, but got {quoted(data)}.")
    return data


def _text(data: Any, where: str) -> str:
    if not isinstance(data, str):
        raise FileRefused(f"{where} wants a text, but got {quoted(data)}.")
    return data


def _finite(number: float, where: str) -> float:
    if not math.isfinite(number):
        raise FileRefused(f"{where} wants a finite number, but got {number}.")
    return number
