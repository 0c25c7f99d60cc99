"""A hand's contacts carried onto a rabbit's head and back, in one go each.

Four finger pads and the thumb's hang on the palm: one geodesic each, from axis to axis. One click and one direction
carry the whole tree, and every pad lies down on what it meets: the crown and cheeks of the head, the flanks of the
body.

The Stanford bunny itself is measured where `CONTACT_ASSETS` has it, and not pictured: its licence is for research.
"""

import numpy as np

import contact_core as contact
from contact_core.geometry.raycast import Locator
from contact_core.scene.picture import Picture
from contact_gallery.looks import view
from contact_gallery.sheet import Sheet

PAPER = "Figure 10"
Vector = tuple[float, float, float]
# Where the palm's axis starts, which way it goes, and from where it is seen.
RABBIT: dict[str, tuple[Vector, Vector, Vector]] = {
    "onto the head": ((0.028, 0.178, -0.024), (0.0, 0.0, 1.0), (1.0, 0.1, -0.15)),
    "onto the back": ((-0.03, 0.12, 0.04), (0.0, 0.0, -1.0), (-0.9, 1.0, 0.5)),
}
BUNNY: dict[str, tuple[Vector, Vector, Vector]] = {
    "onto the bunny's head": ((0.09, 0.15, -0.02), (0.0, 1.0, 0.0), (0.8, 0.4, 0.5)),
    "onto the bunny's back": ((-0.02, 0.14, 0.04), (0.0, 0.0, -1.0), (-0.9, 1.0, 0.5)),
}
PADS = ("thumb_distal", "index_intermediate", "middle_intermediate", "ring_intermediate", "little_intermediate")


def draw(sheet: Sheet) -> None:
    with contact.new(hand="sample:human_hand", rabbit="sample:rabbit", plugins=sheet.plugins) as session:
        rig = session.rigs["hand"]
        at = {name: rig.rest_world[rig.joint_index(name), :3, 3] for name in rig.joints}
        with sheet.counting(session):
            knuckles = np.array([at["index_proximal"], at["little_proximal"]]) + np.array([0.0, -0.017, 0.02])
            session.patches.brush("disk", "palm", surface="hand", at=knuckles, radius=0.010, spacing=0.0015)
            for name in PADS:
                over = at[name] + np.array([0.0, 0.009, 0.02])
                session.patches.brush("disk", name, surface="hand", at=over, radius=0.006, spacing=0.0012)
                session.patches.link(name, "palm", parent_point=len(session.geometry.axis("palm")) // 2)
        hand = view(session, "hand", camera_from=(0.25, 0.1, 1.0), caption="six contacts, one tree")
        sheet.show(hand, *carried(sheet, session, "rabbit", RABBIT))
        bunny = sheet.asset("stanford_bunny_7k_closed.obj")
        if bunny is not None:
            session.surfaces.add("bunny", standing(bunny.mesh))
            carried(sheet, session, "bunny", BUNNY)


def carried(
    sheet: Sheet, session: contact.Session, thing: str, places: dict[str, tuple[Vector, Vector, Vector]]
) -> list[Picture]:
    """The tree on each place of a thing, pictured and measured."""
    pictures = []
    for caption, (where, direction, camera) in places.items():
        start = Locator.of(session.geometry.mesh(thing)).closest([where]).points
        with sheet.counting(session) as log:
            copies = session.patches.transfer_tree("palm", thing, start, direction=direction)
        for source, copy in copies.items():
            session.patches.recolor(copy, session.document.patch(source).color)
        shown = list(copies.values())
        pictures.append(view(session, thing, patches=shown, camera_from=camera, caption=caption))
        found = [session.geometry.distortion(source, copy) for source, copy in copies.items()]
        off = sum(int(session.geometry.reconstruction(copy).ran_off.sum()) for copy in shown)
        low, high = np.nanpercentile(np.concatenate([one.length_ratio for one in found]), [2.5, 97.5])
        folds = sum(one.folds for one in found)
        sheet.measure(f"{caption}: folds, points off the surface", f"{folds}, {off}", "adapts well")
        lengths = f"{low:.2f} to {high:.2f}"
        sheet.measure(f"{caption}: change of length, 95 % of all points", lengths, "as isometric as possible")
        sheet.measure(f"{caption}: operations", f"{log.summary()['operations']}", "a few mouse clicks")
    return pictures


def standing(mesh: contact.TriangleMesh) -> contact.TriangleMesh:
    """The bunny 20 cm tall, on the ground, looking along +x as the rabbit does."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle = np.array([0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])])
    return mesh.with_points((mesh.points - middle) * np.array([-1.0, 1.0, -1.0]) * 0.2 / (high[1] - low[1]))
