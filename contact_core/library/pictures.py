"""How a saved grasp looks: its thumbnail, and a page of all thumbnails of a library."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import ContactError, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.library.carrying import palm_in_rig
from contact_core.library.shelf import Entry, Library
from contact_core.plugins.drawing import draw
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.scene.picture import Picture, PictureMesh

if TYPE_CHECKING:
    from contact_core.grasping.scene import GraspScene
    from contact_core.plugins.manager import PluginManager

SIZE = (360, 320)  # pixels
SKIN, THING = (0.84, 0.64, 0.53), (0.62, 0.69, 0.76)
NEAR = 0.5  # hand lengths: how much of the object round the hand is in the frame
_STYLE = """
:root{color-scheme:light dark;--ink:#1d2129;--dim:#6a7280;--page:#f6f6f8;--card:#fff;--line:#e3e5ea;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ec;--dim:#9aa3b2;--page:#17191d;--card:#202329;--line:#32363e;
--bad:#ff8a80}}
*{box-sizing:border-box}body{margin:0;padding:2rem;background:var(--page);color:var(--ink);
font:15px/1.4 system-ui,sans-serif}h1{font-size:1.4rem;margin:0 0 1rem}
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(230px,1fr));gap:1rem}
figure{margin:0;background:var(--card);border:1px solid var(--line);border-radius:.5rem;overflow:hidden}
img,.none{display:block;width:100%;aspect-ratio:9/8;object-fit:cover;background:var(--page)}
.none{display:grid;place-items:center;color:var(--dim)}
figcaption{padding:.6rem .8rem}b{overflow-wrap:anywhere}p{margin:.2rem 0 0;color:var(--dim);font-size:.85rem}
.bad{color:var(--bad)}
"""


def thumbnail(scene: GraspScene, plugins: PluginManager) -> bytes | None:
    """A PNG of the grasp that a scene's document holds; None where no renderer can draw."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        try:
            draw([picture_of(scene)], path, plugins, size=SIZE)
        except InvalidInput:
            return None
        return path.read_bytes()


def picture_of(scene: GraspScene, pose: Pose | None = None, caption: str = "") -> Picture:
    """The hand on the object from the thumb's side, a little from before the palm, fingers up. pose: the document's
    by default."""
    hand, rig = scene.hand, scene.rig
    pose = pose or scene.document.poses.get(scene.hand_name) or Pose.rest(rig)
    own = forward_kinematics(rig.parents, pose.local[[pose.joints.index(name) for name in rig.joints]])
    object_from_rig = scene.object_from_rig
    posed = TriangleMesh(transform_points(object_from_rig, skin(rig, own)), rig.faces)
    palm = (object_from_rig @ palm_in_rig(hand, own))[:3, :3]
    digits = posed.points[np.concatenate(hand.skin_of_digits)]
    near = np.linalg.norm(scene.mesh.points - digits.mean(axis=0), axis=1) < NEAR * hand.length
    base = (object_from_rig @ palm_in_rig(hand, own))[:3, 3]
    eye: FloatArray = palm @ np.array([0.35, 0.3, _thumb_side(scene)])
    return Picture(
        meshes=(PictureMesh(posed, SKIN), PictureMesh(scene.mesh, THING)),
        camera_from=(float(eye[0]), float(eye[1]), float(eye[2])),
        up=tuple(palm[:, 1].tolist()),
        caption=caption,
        focus=np.concatenate([digits, scene.mesh.points[near], base[None]]),
    )


def _thumb_side(scene: GraspScene) -> float:
    """On which side of the palm, along z of its frame, the thumb is."""
    thumb = scene.hand.description.thumb
    if thumb is None:
        return 1.0
    away = scene.hand.frame[:, 2] @ (thumb.tip - scene.hand.description.palm.point)
    return 1.0 if away >= 0.0 else -1.0


def page_of(library: Library, entries: Iterable[Entry], title: str) -> str:
    """An HTML page of thumbnails, without scripts and with nothing from a network."""
    figures = "\n".join("".join(_figure(library, entry)) for entry in entries)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; style-src'
        ' \'unsafe-inline\'"><meta name="viewport" content="width=device-width">'
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1><main>\n{figures}\n</main></body></html>\n"
    )


def _figure(library: Library, entry: Entry) -> Iterator[str]:
    yield "<figure>"
    try:
        picture = library.picture(f"{entry.name}@{entry.version}")
    except ContactError:
        picture = None
    if picture is None:
        yield '<div class="none">no picture</div>'
    else:
        data = base64.b64encode(picture).decode()
        yield f'<img alt="{escape(entry.name)}" src="data:image/png;base64,{data}">'
    yield f"<figcaption><b>{escape(entry.name)}</b>"
    if entry.grasp is None:
        yield f'<p class="bad">{escape(entry.problem)}</p>'
    else:
        grasp = entry.grasp
        yield f"<p>{escape(', '.join([grasp.kind, *grasp.tags]))}</p>"
        yield f"<p>{escape(grasp.hand.name)} on {escape(grasp.object.name)}</p>"
        yield f"<p>{escape(grasp.note)}</p>" if grasp.note else ""
    yield "</figcaption></figure>"
