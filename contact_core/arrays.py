"""Checked, read-only arrays: the only kind that the core's values hold."""

from __future__ import annotations

import contextlib
import hashlib
import math
import mmap
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_core.errors import InvalidInput

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Int32Array = npt.NDArray[np.int32]
SingleArray = npt.NDArray[np.float32]
ComplexArray = npt.NDArray[np.complex128]

_SPARSE = 1 << 22  # bytes: below, memory is not worth two ways of asking for it
SMALL = 4096  # numbers of an array for which a call costs more than a pass


def frozen(values: Any, dtype: npt.DTypeLike, shape: tuple[int | None, ...], name: str) -> npt.NDArray[Any]:
    """A contiguous read-only array of `dtype` and `shape` (None: any extent); a copy unless already frozen.

    Raises InvalidInput naming the array when the shape does not fit or a value is NaN or infinite.
    """
    wanted = np.dtype(dtype)
    if type(values) is np.ndarray and _is_as_wanted(values, wanted, shape):
        return values  # most of what a document holds when it is read
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} must be an array of numbers of shape {_spell(shape)}; got {error}.") from error
    if array.size == 0 and array.ndim != len(shape):  # an empty list has no shape of its own
        array = np.zeros(tuple(extent or 0 for extent in shape))
    if array.dtype.kind not in "biufc":
        raise InvalidInput(f"{name} must be an array of numbers of shape {_spell(shape)}; got {array.dtype}.")
    if array.dtype.kind == "c" and wanted.kind != "c":
        raise InvalidInput(f"{name} must hold real numbers, but holds complex ones ({array.dtype}).")
    wants_whole = wanted.kind in "iu" and array.dtype.kind == "f"
    if wants_whole and not (np.isfinite(array).all() and np.array_equal(array, np.trunc(array))):
        raise InvalidInput(f"{name} must hold whole numbers, but holds fractions or NaN ({array.dtype}).")
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InvalidInput(f"{name} must have shape {_spell(shape)}, but has {array.shape}.")
    if not (array.dtype == wanted and array.flags.c_contiguous and _is_immutable(array)):
        array = np.array(array, dtype=dtype, order="C", copy=True)
        array.setflags(write=False)
    if array.dtype.kind in "fc" and not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        raise InvalidInput(f"{name} must be finite, but entry {where} is {array[tuple(where)]}.")
    return array


def all_finite(array: npt.NDArray[Any]) -> bool:
    """Whether an array of numbers holds no NaN and no infinity."""
    if array.dtype.kind not in "fc":
        return True
    if 0 < array.size < SMALL and math.isfinite(
        np.vdot(array, array).real
    ):  # one pass, no array; squares may overflow
        return True
    return bool(np.isfinite(array).all())


def sparse_zeros(shape: tuple[int, ...]) -> FloatArray:
    """Zeros of which only what is written to takes memory, by pages of 4 kB.

    numpy's own large arrays come in pages of 2 MB on Linux: an array that is written to here and there would soon
    be in memory as a whole.
    """
    size = 8 * math.prod(shape)
    if size < _SPARSE:
        return np.zeros(shape)
    if not hasattr(mmap, "MAP_PRIVATE"):  # Windows
        return np.frombuffer(mmap.mmap(-1, size)).reshape(shape)
    pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANON)  # private: a forked process has its own
    with contextlib.suppress(AttributeError, OSError):  # systems that have no such pages
        pages.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(pages).reshape(shape)


def digest(*arrays: npt.NDArray[Any]) -> str:
    """A short content digest (32 hex digits) of the bytes and shapes of arrays, in order."""
    state = hashlib.sha256()
    for array in arrays:
        state.update(repr((array.dtype.str, array.shape)).encode())
        state.update(np.ascontiguousarray(array).data)
    return state.hexdigest()[:32]


def _is_immutable(array: npt.NDArray[Any]) -> bool:
    """Whether nobody can write to the memory: the array and every array that it views are read-only."""
    holder: Any = array
    while isinstance(holder, np.ndarray):
        if holder.flags.writeable:
            return False
        holder = holder.base
    return holder is None  # anything else is memory that another library owns


def _is_as_wanted(array: npt.NDArray[Any], wanted: np.dtype[Any], shape: tuple[int | None, ...]) -> bool:
    """Whether nothing is to be done to make an array what `frozen` returns."""
    if array.dtype != wanted or array.ndim != len(shape) or not array.flags.c_contiguous:
        return False
    for want, got in zip(shape, array.shape, strict=True):
        if want is not None and want != got:
            return False
    return _is_immutable(array) and all_finite(array)


def _spell(shape: tuple[int | None, ...]) -> str:
    return (
        "("
        + ", ".join("any" if extent is None else str(extent) for extent in shape)
        + ("," if len(shape) == 1 else "")
        + ")"
    )
