"""A surface of several pieces, and the proxy that carries a contact across them.

A rabbit wears a scarf that is a mesh of its own, pushed over the rabbit's neck. A contact that climbs the chest
runs on under the scarf, for a geodesic knows no other piece. With a proxy, a closed manifold near all pieces, it
climbs over the scarf, and is still picked and given on the mesh that the artist has.
"""

import numpy as np

import contact_core as contact
from contact_core.arrays import BoolArray
from contact_core.geometry.raycast import Locator
from contact_core.scene.picture import Picture
from contact_core.testing import meshes
from contact_gallery.looks import rotation, view
from contact_gallery.sheet import Sheet

PAPER = "Figure 19"


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", rabbit="sample:rabbit", plugins=sheet.plugins) as session:
        rig, rabbit = session.rigs["hand"], with_scarf(session.geometry.mesh("rabbit"))
        session.surfaces.add("dressed rabbit", rabbit)
        middle = [rig.joint_index(f"middle_{part}") for part in ("proximal", "intermediate", "distal")]
        along = rig.rest_world[middle, :3, 3] + np.array([0.0, 0.0, 0.012])
        axis = Locator.of(session.geometry.mesh("hand")).closest(along).points
        with sheet.counting(session):
            session.patches.brush(
                "disk", "finger", surface="hand", at=along, radius=0.007, spacing=0.0015, axis=axis
            )
        chest = Locator.of(rabbit).closest([(0.08, 0.075, 0.0)]).points
        pictures: list[Picture] = []
        for caption in ("(a) under the scarf", "(b) over it, by a proxy"):
            with sheet.counting(session):
                if pictures:
                    session.surfaces.add_proxy("dressed rabbit")
                copy = session.patches.transfer(
                    "finger", "dressed rabbit", chest, direction=(0, 1, 0), name=caption
                )
            pictures.append(
                view(session, "dressed rabbit", patches=[copy], camera_from=(1.0, 0.1, 0.7), caption=caption)
            )
            above = 100.0 * np.mean(~hidden(rabbit, session.geometry.points(copy)))
            sheet.measure(f"{caption[4:]}: points that can be seen", f"{above:.0f} %", "possible, less exact")
        carrier = session.geometry.carrier("dressed rabbit")
        sheet.measure("triangles of the rabbit, of its proxy", f"{len(rabbit.faces):,}, {len(carrier.faces):,}")
        sheet.show(*pictures)


def with_scarf(rabbit: contact.TriangleMesh) -> contact.TriangleMesh:
    """The rabbit and a torus round its neck, two pieces in one mesh."""
    ring = meshes.torus(96, 32, 0.036, 0.011)  # about z
    lean = rotation((1, 0, 0), -90.0)[:3, :3]
    points = ring.points @ (rotation((0, 0, 1), -14.0)[:3, :3] @ lean).T + np.array([0.036, 0.105, 0.0])
    faces = np.concatenate([rabbit.faces, ring.faces + len(rabbit.points)])
    return contact.TriangleMesh(np.concatenate([rabbit.points, points]), faces)


def hidden(mesh: contact.TriangleMesh, points: contact.SurfacePoints) -> BoolArray:
    """(n,) which points of a mesh another piece of it covers."""
    outward = points.normals(mesh)
    return np.asarray(Locator.of(mesh).cast(points.positions(mesh) + 1e-4 * outward, outward, 0.02).found)
