"""Weights of vertex groups, a whole group at a time.

Blender's Python gives weights vertex by vertex (7 us each). But geometry nodes see vertex groups as attributes.
On a copy of the mesh, in a scene of its own for the length of one call, a node tree stores them as plain floats,
which come as blocks of memory: 100,000 vertices in 30 groups take 0.06 s instead of 0.9 s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from contact_core.arrays import FloatArray, IntArray

_AT_ONCE = 16  # groups stored at a time, which bounds the memory of the copy
_NAME = ".contact_weights"


def group_weights(mesh: Any, groups: Sequence[int]) -> Iterator[FloatArray]:
    """(n,) weights of each group of a mesh datablock, by its number; 0 for a vertex that is not in it."""
    groups = [int(group) for group in groups]
    if not groups or not len(mesh.vertices):
        yield from (np.zeros(len(mesh.vertices)) for _ in groups)
        return
    with _twin(mesh, groups) as (twin, layer):
        modifier = twin.modifiers.new(_NAME, "NODES")
        for start in range(0, len(groups), _AT_ONCE):
            some = groups[start : start + _AT_ONCE]
            tree = _storing(some)
            try:
                modifier.node_group = tree
                layer.update()
                attributes = twin.evaluated_get(layer.depsgraph).data.attributes
                for group in some:
                    weights = np.empty(len(mesh.vertices), np.float32)
                    attributes[_stored(group)].data.foreach_get("value", weights)
                    yield weights.astype(np.float64)
            finally:
                modifier.node_group = None
                bpy.data.node_groups.remove(tree)


def influences(mesh: Any, joint_of_group: dict[int, int]) -> tuple[IntArray, FloatArray]:
    """(n, K) joints, ascending, and their weights where above 0; the rest of a row is joint 0 with weight 0."""
    groups = sorted(joint_of_group, key=joint_of_group.__getitem__)
    found: list[tuple[IntArray, FloatArray]] = []  # vertices and weights of each group
    for weights in group_weights(mesh, groups):
        inside = np.flatnonzero(weights > 0.0)
        found.append((inside, weights[inside]))
    count = np.zeros(len(mesh.vertices), np.int64)
    width = int(sum((np.bincount(v, minlength=len(count)) for v, _ in found), start=count).max(initial=0)) or 1
    joints, weights_of = np.zeros((len(count), width), np.int64), np.zeros((len(count), width))
    for group, (inside, weights) in zip(groups, found, strict=True):
        joints[inside, count[inside]], weights_of[inside, count[inside]] = joint_of_group[group], weights
        count[inside] += 1
    return joints, weights_of


@contextmanager
def _twin(mesh: Any, groups: Sequence[int]) -> Iterator[tuple[Any, Any]]:
    """An object of a copy of the mesh, its groups renamed: no attribute is called alike; its view layer."""
    copy = mesh.copy()
    twin = bpy.data.objects.new(_NAME, copy)
    aside = bpy.data.scenes.new(_NAME)
    try:
        aside.collection.objects.link(twin)
        while len(twin.vertex_groups) <= max(groups):  # a copy out of Edit Mode has lost their names
            twin.vertex_groups.new()
        for group in groups:
            twin.vertex_groups[group].name = f"{_NAME} {group}"
        yield twin, aside.view_layers[0]
    finally:
        bpy.data.scenes.remove(aside)
        bpy.data.objects.remove(twin)
        bpy.data.meshes.remove(copy)


def _storing(groups: Sequence[int]) -> Any:
    """A node tree that stores vertex groups as float attributes."""
    tree = bpy.data.node_groups.new(_NAME, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    for group in groups:
        read, store = (tree.nodes.new(f"GeometryNode{kind}NamedAttribute") for kind in ("Input", "Store"))
        read.data_type = store.data_type = "FLOAT"
        store.domain = "POINT"
        read.inputs["Name"].default_value, store.inputs["Name"].default_value = f"{_NAME} {group}", _stored(group)
        tree.links.new(geometry, store.inputs["Geometry"])
        tree.links.new(read.outputs[0], store.inputs["Value"])
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def _stored(group: int) -> str:
    return f"{_NAME} of {group}"
