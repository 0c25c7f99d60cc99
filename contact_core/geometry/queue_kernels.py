"""The queue of a search: a heap in order of distance, and a stack of what goes on at once.

Windows leave the heap in order of distance for thrift alone: light from afar meets vertices that nearer light has
reached, and is dropped. Only vertices need the order, to be final when they cast their shadows. So a window that
leaves the heap sets a horizon further off by the shortest edge of its face (the last of `keys`), and windows that
lie within it go on from the stack: one in a hundred comes too early, but most of the heap's work is saved, and a
child follows its parent while their faces are in the cache (W 1.12 to 0.85 ms). A vertex waits in the heap, so
that all nearer windows go before it.

`keys` and `items` are both the heap, from their beginning, and `items` the stack, from its end.
"""

from __future__ import annotations

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined

# Entries of state
HEAP_SIZE, STACK_SIZE, FREE, USED, POPS, WINDOWS, OVERFLOW = (
    constant(0), constant(1), constant(2), constant(3), constant(4), constant(5), constant(6),
)  # fmt: skip


@inlined
def heap_push(key: float, item: int, keys: FloatArray, items: IntArray, state: IntArray) -> None:
    """Insert into the min-heap, four children a node; sets OVERFLOW when it is full."""
    i = state[HEAP_SIZE]
    if i + state[STACK_SIZE] >= len(items) - 1:
        state[OVERFLOW] = 1
        return
    state[HEAP_SIZE] = i + 1
    while i > 0:
        parent = (i - 1) >> 2
        if keys[parent] <= key:
            break
        keys[i], items[i] = keys[parent], items[parent]
        i = parent
    keys[i], items[i] = key, item


@inlined
def heap_pop(keys: FloatArray, items: IntArray, state: IntArray) -> int:
    """Remove the item of the smallest key."""
    top = items[0]
    size = state[HEAP_SIZE] - 1
    state[HEAP_SIZE] = size
    key, item = keys[size], items[size]
    i = 0
    while True:
        child = 4 * i + 1
        if child >= size:
            break
        least, last = keys[child], min(child + 4, size)
        for other in range(child + 1, last):
            if keys[other] < least:
                child, least = other, keys[other]
        if least >= key:
            break
        keys[i], items[i] = least, items[child]
        i = child
    keys[i], items[i] = key, item
    return top


@inlined
def stack_push(item: int, items: IntArray, state: IntArray) -> None:
    """Put a window on the stack, which grows from the end of the heap's memory; sets OVERFLOW when they meet."""
    if state[HEAP_SIZE] + state[STACK_SIZE] >= len(items) - 1:
        state[OVERFLOW] = 1
        return
    state[STACK_SIZE] += 1
    items[len(items) - state[STACK_SIZE]] = item


@inlined
def stack_pop(items: IntArray, state: IntArray) -> int:
    """Remove the item that came last."""
    item = items[len(items) - state[STACK_SIZE]]
    state[STACK_SIZE] -= 1
    return item
