"""Compilation of kernels: the one place that knows numba's options, its cache and its first-compile wait.

Kernels are plain functions on flat arrays of float64 and int64. They allocate nothing, so reference counting is
switched off (measured: 4 to 5 times faster). A public function imports its kernels when it is first called;
importing the package imports no numba.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba.core import event
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload

Function = TypeVar("Function", bound=Callable[..., Any])


# Integer constants of kernels must be int64 like all their integers: numba compiles a function again for each other
# width and each literal (measured: six copies of one function).
def constant(value: int) -> int:
    """A module constant for kernels."""
    return np.int64(value)  # type: ignore[return-value]


_kernels: set[int] = set()  # ids of our dispatchers: other people's kernels compile without our notice


# numba's cache asks whether a kernel's own file changed, but not whether the kernels that it calls did: machine
# code compiled from older helpers would live on after an upgrade. So every kernel carries the stamp of them all.
_files = [path.stat() for path in [Path(__file__), *sorted(Path(__file__).parents[1].glob("*/*kernel*.py"))]]
_stamp = (max(file.st_mtime for file in _files), sum(file.st_size for file in _files))


def reference_counting_is_off() -> bool:
    """Whether this numba accepts the private option that removes reference counting."""
    return "_nrt" in _OPTIONS


def kernel(function: Function) -> Function:
    """Compile lazily, once per machine: cached beside the source, else in the user's cache, else not at all.

    The function must not allocate arrays: it writes into those that it is given.
    """
    return _compiled(function, _OPTIONS)


def inlined(function: Function) -> Function:
    """A part of kernels: LLVM puts its body in place of every call.

    A call hands over every array as seven numbers, so that calls cost more than what they called: workload W fell
    from 2.8 to 1.5 ms. For what runs for every window or crossing; code grows with every call of it.
    """
    return _without_entry(_compiled(function, {**_OPTIONS, **_INNER, **_INLINED}))


def inner(function: Function) -> Function:
    """A part of kernels that Python never calls: compiled without what Python would call it by, a third of the time
    that it takes to compile."""
    return _without_entry(_compiled(function, {**_OPTIONS, **_INNER}))


def memory_fence() -> None:
    """In kernels: what was written before is seen by other threads before what is written after, and what is read
    after is read after. In Python nothing is to be done."""


@intrinsic
def _fence(context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.fence("acq_rel")
        return context.get_dummy_value()

    return numba.types.void(), generate


@overload(memory_fence)  # not inline="always", which loses the writes before it (numba 0.68)
def _compiled_memory_fence() -> Any:
    return lambda: _fence()


def prefetch(array: Any, index: int) -> None:
    """In kernels: the number at this index of the memory of a contiguous array will be read soon. In Python nothing
    is to be done."""


@intrinsic
def _prefetch(context: Any, array: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        byte, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        instruction = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte], ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag])
        )
        address = builder.bitcast(builder.gep(data, [arguments[1]]), byte)
        builder.call(instruction, [address, flag(0), flag(3), flag(1)])  # for reading, into all caches, data
        return context.get_dummy_value()

    return numba.types.void(array, numba.types.int64), generate


@overload(prefetch)
def _compiled_prefetch(array: Any, index: Any) -> Any:
    def implementation(array: Any, index: Any) -> Any:
        return _prefetch(array, index)

    return implementation


class _Part(CPUDispatcher):  # type: ignore[misc]
    """What has no entry for Python says so; a call would end the process."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        name = self.py_func.__name__
        raise TypeError(
            f"{name} is a part of kernels, compiled without an entry for Python, but was called from there: call a"
            f" kernel that uses it, or {name}.py_func, which is the same in Python."
        )


def _without_entry(dispatcher: Any) -> Any:
    """The dispatcher of a part; where numba refused the options it has an entry like any other."""
    if _INNER:
        dispatcher.__class__ = _Part
    return dispatcher


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba found no directory that it may write to
        dispatcher = numba.njit(**options)(function)
    with contextlib.suppress(AttributeError):  # a numba whose cache looks different inside
        cache = dispatcher._cache._cache_file
        cache._source_stamp = (cache._source_stamp, _stamp)
    _kernels.add(id(dispatcher))
    return dispatcher


def _accepted(option: dict[str, Any]) -> dict[str, Any]:
    """An option that numba does not document: taken where it is accepted, done without where it is not."""
    try:
        numba.njit(**option)(lambda x: x)
    except Exception:  # whichever way a future numba refuses it
        return {}
    return option


class _Notice(event.Listener):  # type: ignore[misc]
    """Says once that a first compile is running, so that nobody believes in a hang."""

    shown = False

    def on_start(self, event: Any) -> None:
        if not self.shown and id(event.data.get("dispatcher")) in _kernels:
            self.shown = True
            sys.stderr.write(
                "contact-core: compiling geodesic kernels, once on this machine (some ten seconds)...\n"
            )
            sys.stderr.flush()

    def on_end(self, event: Any) -> None:
        pass


_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, **_accepted({"_nrt": False})}
_INLINED: dict[str, Any] = _accepted({"forceinline": True})
_INNER: dict[str, Any] = _accepted({"no_cpython_wrapper": True, "no_cfunc_wrapper": True})
event.register("numba:compile", _Notice())
