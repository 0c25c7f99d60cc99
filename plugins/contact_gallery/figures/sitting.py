"""A full body sits down: thighs on the seat, back to the rest, feet on the floor, hands on the knees.

Contacts are strips of the body carried to chair, floor and, for the hands, to the body itself. Skin stretches at
the back of a bent hip, so the strips on the seat are stretched as much; the feet stand under the knees. The solve
goes in stages as in the paper: the root first, then the legs, then arms and trunk, while who sits stays seated.
"""

import numpy as np

import contact_core as contact
from contact_builtins.terms.aims import Look, LookTerm
from contact_core.arrays import FloatArray
from contact_core.geometry.raycast import Locator
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.terms import paper_terms
from contact_gallery.looks import deepest, rotation, view
from contact_gallery.sheet import Sheet, timed

PAPER = "Figure 15"
Vector = tuple[float, float, float]
LEGS = tuple(f"{part}_{side}" for side in "lr" for part in ("thigh", "calf", "foot"))
ARMS = tuple(f"{part}_{side}" for side in "lr" for part in ("clavicle", "upperarm", "lowerarm", "hand"))
SEAT, FEET = ("seat_l", "seat_r"), ("foot_l", "foot_r")
STAGES = [
    {"name": "root", "free": {"body": ["hips"]}, "contacts": SEAT},
    {"name": "legs", "free": {"body": ["hips", *LEGS]}, "contacts": (*SEAT, *FEET)},
    {
        "name": "arms and trunk",
        "free": {"body": [*ARMS, "spine_1", "spine_2", "chest", "neck", "head"]},
    },
]
CLAIMS = {"seat_l": "settled", "back": "settled", "foot_l": "aligned with the floor", "hand_l": "brought inwards"}
WEIGHTS = {"back": 2.0, "foot_l": 2.0, "foot_r": 2.0}
BACK, FRONT, DOWN = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)


def draw(sheet: Sheet) -> None:
    with contact.new(
        body="sample:human_body", chair="sample:chair", floor="sample:floor", plugins=sheet.plugins
    ) as session:
        rig = session.rigs["body"]
        mesh = {name: session.geometry.mesh(name) for name in ("body", "chair", "floor")}
        at = {name: rig.rest_world[joint, :3, 3] for joint, name in enumerate(rig.joints)}

        def hit(surface: str, origins: FloatArray, way: Vector) -> contact.SurfacePoints:
            return Locator.of(mesh[surface]).cast(origins, np.broadcast_to(way, np.shape(origins))).points

        def touch(
            name: str,
            ends: FloatArray,
            way: Vector,
            where: contact.SurfacePoints,
            onto: str,
            heading: Vector | FloatArray,
            width: float,
        ) -> None:
            """A strip of skin between two places under it, and its copy."""
            skin = hit("body", ends, way)
            session.patches.brush(
                "disk", name, surface="body", at=skin, radius=width, spacing=0.3 * width, axis=skin
            )
            copy = session.patches.transfer(name, onto, where, direction=heading)
            if name in SEAT:
                session.patches.scale(copy, along=1.25)
            session.pairs.add(name, copy, name=name, weight=WEIGHTS.get(name, 1.0))

        with sheet.counting(session, "Body on a chair"):
            session.surfaces.place("body", rotation((0, 1, 0), 0.0, (0.0, 0.0, 0.75)))
            for side, sign in (("l", 1.0), ("r", -1.0)):
                hip, knee = at[f"thigh_{side}"], at[f"calf_{side}"]
                ends = np.array([hip + 0.12 * (knee - hip), hip + 0.62 * (knee - hip)])
                seat = Locator.of(mesh["chair"]).closest([(0.1 * sign, 0.47, -0.09)]).points
                touch(f"seat_{side}", ends, BACK, seat, "chair", FRONT, 0.03)
                heel, toe = (
                    at[f"foot_{side}"] * [1, 0, 1] + [0, 0.035, -0.01],
                    at[f"toes_{side}"] * [1, 0, 1] + [0, 0.02, 0.03],
                )
                ground = Locator.of(mesh["floor"]).closest([(0.11 * sign, 0.0, 0.28)]).points
                touch(f"foot_{side}", np.array([heel, toe]), DOWN, ground, "floor", toe - heel, 0.02)
                wrist, fingers = at[f"hand_{side}"], at[f"fingers_{side}"]
                palm = np.array([wrist + 0.35 * (fingers - wrist), fingers])
                lap = hit("body", (hip + 0.75 * (knee - hip))[None], FRONT)
                touch(f"hand_{side}", palm, (-0.5 * sign, -0.55, -0.67), lap, "body", knee - hip, 0.022)
            shoulder_blades = at["chest"] + np.array([(-0.09, -0.01, 0.0), (0.09, -0.01, 0.0)])
            rail = Locator.of(mesh["chair"]).closest([(-0.09, 0.92, 0.0)]).points
            touch("back", shoulder_blades, BACK, rail, "chair", (1.0, 0.0, 0.0), 0.02)
            standing = view(
                session, camera_from=(1.0, 0.35, 0.9), caption="(a) contacts", frame=["body", "chair"], axes=False
            )
            x, y, z = rig.rest_world[rig.joint_index("head"), 1, :3]  # what of the head looks up
            gaze = LookTerm((Look("body", "head", (0.0, 100.0, 0.0), (float(x), float(y), float(z))),))
            terms = [*paper_terms(), PenetrationTerm(resolution=96), gaze]
            proposal, spent = timed(
                lambda: session.solve(solver="staged", solver_settings={"stages": STAGES}, terms=terms)
            )
            session.accept(proposal)
        views = {"(b) seated": (1.0, 0.35, 0.9), "(c)": (-1.0, 0.25, 0.45), "(d)": (0.9, 0.3, -0.8)}
        seated = [
            view(session, camera_from=side, caption=text, frame=["body", "chair"], axes=False)
            for text, side in views.items()
        ]
        sheet.show(standing, *seated, aspect=0.75)
        for name, claim in CLAIMS.items():
            met = proposal.after.patches[name]
            told = f"{1000 * met.mean:.0f} mm apart, {100 * met.opposed_45:.0f} % of it faces what it touches"
            sheet.measure(name.replace("_l", ", left"), told, claim)
        for solid in ("chair", "floor"):
            sheet.measure(f"deepest skin in the {solid}", f"{1000 * deepest(session, 'body', solid):.0f} mm")
        sheet.measure(
            "solve",
            f"{spent:.2f} s for {len(proposal.after.theta)} degrees of freedom",
            "root, then legs, then arms",
        )
