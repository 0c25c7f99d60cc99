"""Three contact models on one transfer: axis, single point, boundary.

A strip round a bent tentacle's side goes onto a pole. The axis model spreads its base points along the strip. One
log map from the strip's middle loses what is far from it, and folds it over. The boundary alone, traced as a closed
chain, does not close, and has no points inside. Both rivals are written from their papers, and start where the axis
model puts the same points. Blue: lengths shrank, red: they grew by two.
"""

from dataclasses import replace

import numpy as np

import contact_core as contact
from contact_core.contact.distortion import measure_distortion
from contact_core.geometry.raycast import Locator
from contact_core.rig.poses import set_angles
from contact_core.scene.picture import PictureMesh
from contact_gallery.looks import heat_of, on, tube, view
from contact_gallery.other_models import boundary_alone, single_point
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 14"


def draw(sheet: Sheet) -> None:
    skin, along = curled(sheet)
    with contact.new(tentacle=skin, pole="sample:pole", plugins=sheet.plugins) as session:
        pole = session.geometry.mesh("pole")
        strokes = [
            contact.BrushGesture(skin, along[k : k + 2], radius=w, spacing=0.3 * w)
            for k, w in enumerate(np.linspace(0.018, 0.006, 16))
        ]
        with sheet.counting(session):
            session.patches.brush("disk", "strip", *strokes, surface="tentacle", axis=along)
            root = Locator.of(pole).closest([(0.05, 0.3, 0.0)]).points
            copy = session.patches.transfer("strip", "pole", root, direction=(0.0, 0.5, 1.0))
        points, axis, placed = (
            session.geometry.points("strip"),
            session.geometry.axis("strip"),
            session.geometry.axis(copy),
        )
        near = np.array([(-0.03, 0.24, -0.03), (0.03, 0.52, 0.03)])
        bare = view(session, "pole", patches=[], camera_from=(1.0, 0.25, 0.0), focus=near)
        shape = session.document.shape_of("strip")
        _, measuring = timed(lambda: session.patches.set_axis("strip", along))
        _, carrying = timed(
            lambda: session.geometry.points(session.patches.transfer("strip", "pole", root, direction=(0, 1, 1)))
        )
        theirs, one_log = timed(lambda: single_point(skin, points, axis, pole, placed))
        (chain, length), walking = timed(lambda: boundary_alone(skin, points, axis, shape, pole, placed))
        session.undo()
        loop = chain.points.positions(pole)
        pictures = [view(session, "tentacle", camera_from=(0.9, 0.3, -0.6), caption="(a) the strip")]
        triangles = session.geometry.area("strip").triangles
        for caption, there in (("(b) axis model", session.geometry.points(copy)), ("(c) one log map", theirs)):
            found = measure_distortion(
                triangles,
                points.positions(skin),
                points.normals(skin),
                there.positions(pole),
                there.normals(pole),
                mirrored=True,
            )
            heat = heat_of(found.length_ratio)
            heat[found.folded] = 0.0
            paint = PictureMesh(
                contact.TriangleMesh(on(pole, there, 0.0015), triangles[:, ::-1]), (1, 1, 1), vertex_colors=heat
            )
            pictures.append(replace(bare, meshes=(*bare.meshes, paint), caption=caption))
            known = found.length_ratio[np.isfinite(found.length_ratio)]
            wrong = float(np.exp(np.percentile(np.abs(np.log(known)), 95)))
            sheet.measure(
                f"{caption[4:]}: folded triangles, 95 % of lengths within",
                f"{found.folds}, {wrong:.2f} times",
                "foldover, breakdown" if there is theirs else "approximately isometric",
            )
        rope = PictureMesh(tube(on(pole, chain.points, 0.002), 0.0018), (0.85, 0.4, 0.05))
        pictures.append(replace(bare, meshes=(*bare.meshes, rope), caption="(d) boundary alone"))
        gap = 100.0 * np.linalg.norm(loop[-1] - loop[0]) / length
        sheet.measure(
            "boundary alone: the loop misses its start by",
            f"{gap:.0f} % of its length",
            "slow flood fill, no interior",
        )
        times = {
            "axis model: measured once, then carried in": f"{1000 * measuring:.0f} ms, {1000 * carrying:.0f} ms",
            "one log map: measured and carried in": f"{1000 * one_log:.0f} ms",
            "boundary alone: measured and carried in": f"{1000 * walking:.0f} ms, and has no interior yet",
        }
        for what, told in times.items():
            sheet.measure(f"{what}, of a processor", told, "real time" if "axis" in what else "")
        sheet.show(*pictures, aspect=0.8)


def curled(sheet: Sheet) -> tuple[contact.TriangleMesh, contact.SurfacePoints]:
    """The tentacle's skin with every joint flexed, as a mesh of its own, and points along the curl's outer side."""
    with contact.new(tentacle="sample:tentacle", plugins=sheet.plugins) as session:
        rig, skin = session.rigs["tentacle"], session.geometry.mesh("tentacle")
        outer = Locator.of(skin).closest(rig.rest_world[3:20, :3, 3] + [0.0, 0.0, -0.06]).points
        angles = {f"{joint}.z": np.radians(13.0) for joint in rig.joints[1:-1]}
        session.surfaces.set_pose("tentacle", set_angles(rig, contact.Pose.rest(rig), angles))
        return session.geometry.posed_mesh("tentacle"), outer
