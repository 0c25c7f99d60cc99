"""Blender: the arrays of a million triangles, one edit of a patch through the adapter, undo, poses, evaluation.

    python benchmarks/bench_blender.py [--blender 5.0]

Runs in the Blender environment of adapters/blender/run_tests.py. Medians, wall time. What a surface computes
further (triangles of polygons, its digest) is told apart from reading the arrays.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[1]
SIDE = 708  # points along one side: about a million triangles
TARGETS = {"arrays of 1M triangles": 500.0}  # milliseconds


def in_blender() -> int:
    """Start again where bpy is."""
    spec = importlib.util.spec_from_file_location("run_tests", REPOSITORY / "adapters" / "blender" / "run_tests.py")
    assert spec is not None and spec.loader is not None
    run_tests = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(run_tests)
    blender = sys.argv[sys.argv.index("--blender") + 1] if "--blender" in sys.argv else run_tests.DEFAULT
    try:
        python = run_tests.environment(blender)
    except run_tests.Unavailable as reason:
        print(f"no Blender here: {reason}")
        return 0
    done = run_tests.run_script(python, Path(__file__), *(["--host"] if "--host" in sys.argv else []))
    print(done.stdout + done.stderr)
    return int(done.returncode)


def main() -> None:
    import bpy
    import host_edits
    import numpy as np
    from harness import record

    from contact_blender import mesh as meshes
    from contact_blender.host import BlenderHost

    record(f"{host_edits.TITLE}: Blender {bpy.app.version_string}", edits())
    if "--host" in sys.argv:
        return
    bpy.ops.wm.read_factory_settings(use_empty=True)
    host = BlenderHost()
    rows: dict[str, Any] = {}
    for kind, corners in (("1M triangles", 3), ("500k quads", 4)):
        key = grid(kind, corners)
        item = bpy.data.objects[key]

        def arrays(item: Any = item) -> Any:
            with meshes.evaluated_mesh(item, meshes.current_depsgraph()) as mesh:
                return meshes.read_polygons(mesh)

        rows[f"arrays of {kind}"] = milliseconds(arrays, 7)
        rows[f"surface of {kind}, cut and merged"] = milliseconds(lambda k=key: host.read_surface(k), 3)
        fresh = host.read_surface(key).mesh
        rows[f"digest of {kind}"] = milliseconds(lambda m=fresh: m.with_points(np.array(m.points)).digest, 3)
        bpy.data.objects.remove(item)
    rows |= posing()
    record(f"Blender {bpy.app.version_string}, milliseconds", rows)
    for name, target in TARGETS.items():
        print(f"{name}: {rows[name]:.2f} ms, target {target:g} ms{'' if rows[name] < target else ', MISSED'}")


def edits() -> dict[str, str]:
    """Thirty patches of 500 points on a sheet."""
    import bpy
    import host_edits

    from contact_blender.host import BlenderHost

    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("sheet", 3, 60)
    host = BlenderHost()
    return host_edits.edits(host, host_edits.painted(host, "sheet"))


def posing() -> dict[str, float]:
    """Poses of a 57-dof hand, in milliseconds."""
    import bpy

    from contact_blender.host import BlenderHost
    from contact_core.document.asset import Asset
    from contact_core.testing.host_scenes import bent
    from contact_core.testing.rigs import hand_like

    bpy.ops.wm.read_factory_settings(use_empty=True)
    host = BlenderHost()
    rig = hand_like()
    hand = host.add(Asset("hand", rig.surface, rig, meters_per_unit=1.0))
    poses = [bent(rig, seed) for seed in range(4)]
    frames = iter(range(1, 1000))
    return {
        "write a pose of 17 bones, undo step included": milliseconds(lambda: host.write_pose(hand, poses[1]), 15),
        "key a pose": milliseconds(lambda: host.write_pose(hand, poses[2], float(next(frames))), 15),
        "read a pose at another frame": milliseconds(lambda: host.read_pose(hand, 3.0), 15),
        "Blender's own skin in a pose, taken back": milliseconds(lambda: host.skin_points(hand, poses[3]), 15),
        "read the rig, compared with Blender": milliseconds(lambda: host.read_rig(hand), 5),
    }


def grid(name: str, corners: int, side: int = SIDE) -> str:
    """A wavy sheet of triangles or quads in the scene."""
    import bpy
    import numpy as np

    u, v = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side), indexing="ij")
    points = np.c_[u.ravel(), v.ravel(), 0.1 * np.sin(6 * u * v).ravel()].astype(np.float32)
    corner = np.arange((side - 1) * side).reshape(side - 1, side)[:, :-1].ravel()
    quads = np.c_[corner, corner + side, corner + side + 1, corner + 1].astype(np.int32)
    faces = quads if corners == 4 else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, corners, dtype=np.int32))
    mesh.update(calc_edges=True)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return str(made.name)


def milliseconds(work: Any, repeats: int) -> float:
    """Median wall time of a call, after one that does not count."""
    work()
    times = []
    for _ in range(repeats):
        began = perf_counter()
        work()
        times.append(1e3 * (perf_counter() - began))
    return median(times)


if __name__ == "__main__":
    if importlib.util.find_spec("bpy") is None:
        sys.exit(in_blender())
    main()
