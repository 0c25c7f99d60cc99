"""What the panels of the application show, as plain data: the tree, the settings, the report in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.errors import ContactError, InvalidInput
from contact_core.interaction.heat import LEGEND
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.seen import SeenScene
from contact_core.interaction.tool import TOOLS
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES, PLACERS, POSE_SOLVERS, POSE_TERMS
from contact_core.plugins.slot import Slot
from contact_core.session import Session
from contact_core.settings import Setting, settings_of
from contact_viewer.look import hexed

NEAR, FAR = 0.002, 0.006  # metres: contacts that touch, and those that plainly do not
TILTED, TURNED = 25.0, 50.0  # degrees, likewise
_SLOTS: Mapping[str, Slot[Any]] = {
    slot.hook: slot for slot in (TOOLS, BRUSHES, AXIS_GENERATORS, PLACERS, POSE_SOLVERS, POSE_TERMS)
}
_ELSEWHERE = ("live", "xray", "isolate", "heat")  # have buttons of their own
_NAMED = {"brush": BRUSHES, "generator": AXIS_GENERATORS, "solver": POSE_SOLVERS, "placer": PLACERS}


@dataclass(frozen=True)
class Residual:
    """How well one pair meets. gap: mean distance of points that are to touch, metres. tilt: median angle between
    the skin and the surface that it is to lie against, degrees. level: 0 good, 1 fair, 2 bad."""

    pair: str
    patches: tuple[str, str]
    gap: float
    tilt: float

    @property
    def level(self) -> int:
        """0 good, 1 fair, 2 bad."""
        return max(sum(self.gap > limit for limit in (NEAR, FAR)), sum(self.tilt > t for t in (TILTED, TURNED)))

    def words(self) -> str:
        """What is wrong with it, in a sentence."""
        away = "touches" if self.gap <= NEAR else f"{spelt_length(self.gap)} away"
        tilt = "" if self.tilt <= TILTED else f", tilted by {self.tilt:.0f}°"
        return f"{away}{tilt}"


def residuals(session: Session, scene: SeenScene, document: ContactDocument) -> list[Residual]:
    """Every pair on loaded surfaces, the worst first."""
    found = []
    for pair in document.pairs.values():
        ends = [document.patches.get(name) for name in (pair.manipulator, pair.object)]
        if (
            any(end is None or end.surface not in scene.surfaces for end in ends)
            or pair.name not in session.document.pairs
        ):
            continue
        try:
            geometry = session.geometry.pair(pair.name)
        except ContactError:
            continue
        here = scene.surfaces[geometry.manipulator_surface]
        there = scene.surfaces[geometry.object_surface]
        points, others = geometry.manipulator_points, geometry.object_points
        gap = np.linalg.norm(here.positions(points) - there.positions(others), axis=1)
        facing = np.einsum("ki,ki->k", here.normals(points), there.normals(others))
        tilt = np.degrees(np.arccos(np.clip(-facing, -1, 1)))
        found.append(
            Residual(
                pair.name,
                (pair.manipulator, pair.object),
                float(gap.mean()) * scene.meters_per_unit if len(gap) else 0.0,
                float(np.median(tilt)) if len(tilt) else 0.0,
            )
        )
    return sorted(found, key=lambda each: (-each.level, -each.gap))


def tree(
    session: Session,
    interaction: Interaction,
    meets: Iterable[Residual],
    hidden_surfaces: Iterable[str],
    hidden_patches: Iterable[str],
) -> list[dict[str, Any]]:
    """The rows of the tree: surfaces, below each its patches, below those their children."""
    document, selection = session.document, interaction.selection
    by_patch = {name: each for each in meets for name in each.patches}
    partner = {pair.manipulator: pair.object for pair in document.pairs.values()}
    partner |= {pair.object: pair.manipulator for pair in document.pairs.values()}
    rows: list[dict[str, Any]] = []

    def add(name: str, depth: int) -> None:
        patch, meet = document.patch(name), by_patch.get(name)
        rows.append(
            {
                "key": f"patch {name}",
                "kind": "patch",
                "name": name,
                "depth": depth,
                "color": hexed(patch.color),
                "hidden": name in hidden_patches,
                "locked": interaction.desk.locks.holds(patch),
                "pair": partner.get(name, ""),
                "gap": "" if meet is None else spelt_length(meet.gap),
                "level": -1 if meet is None else meet.level,
                "selected": name in selection.patches,
                "copies": len(document.partners(name)),
            }
        )
        for child in document.children(name):
            if document.patch(child).surface == patch.surface:
                add(child, depth + 1)

    for surface in document.surfaces.values():
        rows.append(
            {
                "key": f"surface {surface.name}",
                "kind": "surface",
                "name": surface.name,
                "depth": 0,
                "rig": surface.rig or "",
                "hidden": surface.name in hidden_surfaces,
                "locked": surface.name in interaction.desk.locks.surfaces,
                "selected": surface.name == selection.surface,
                "loaded": surface.digest in session.derived.known_meshes,
            }
        )
        for patch in document.patches.values():
            if patch.surface == surface.name and not _hangs_here(document, patch.name):
                add(patch.name, 1)
    return rows


def _hangs_here(document: ContactDocument, name: str) -> bool:
    """Whether a patch stands below another of the same surface."""
    return any(document.patch(above).surface == document.patch(name).surface for above in document.ancestors(name))


def settings(interaction: Interaction) -> list[dict[str, Any]]:
    """The settings of the tool in the hand, of the plugins that it names, and of the interaction itself."""
    groups = []
    plugins = interaction.session.plugins
    if interaction.tool:
        groups.append(_group(interaction, TOOLS, interaction.tool))
        tool = interaction.tool_named(interaction.tool)
        for field, slot in _NAMED.items():
            named = getattr(tool, field, None)
            if isinstance(named, str) and named in plugins.offers(slot):
                groups.append(_group(interaction, slot, named))
    groups.append(
        {
            "title": "Live and solving",
            "slot": "",
            "name": "interaction",
            "items": [
                _item(each, each.default, plugins)
                for each in settings_of(interaction.settings)
                if each.name not in _ELSEWHERE
            ],
        }
    )
    return [group for group in groups if group["items"]]


def set_setting(interaction: Interaction, slot: str, name: str, setting: str, value: Any) -> None:
    """Take a value from a panel. Raises InvalidInput with a sentence."""
    if not slot:
        known = {each.name: each for each in settings_of(interaction.settings)}
        if setting not in known:
            raise InvalidInput(f"the interaction has no setting {setting!r}.")
        interaction.set(**{setting: _read(known[setting], value)})
        return
    if slot not in _SLOTS:
        raise InvalidInput(f"there are no settings of {slot!r}.")
    kind = _SLOTS[slot]
    known = {each.name: each for each in interaction.session.plugins.settings_of(kind, name)}
    if setting not in known:
        raise InvalidInput(f"the {kind.noun} {name!r} has no setting {setting!r}.")
    interaction.configure(kind, name, **{setting: _read(known[setting], value)})


def _group(interaction: Interaction, slot: Slot[Any], name: str) -> dict[str, Any]:
    plugins, given = interaction.session.plugins, interaction.desk.given(slot, name)
    items = [_item(each, given.get(each.name, each.default), plugins) for each in plugins.settings_of(slot, name)]
    return {"title": f"{slot.noun} {name}".capitalize(), "slot": slot.hook, "name": name, "items": items}


def _item(setting: Setting, value: Any, plugins: Any) -> dict[str, Any]:
    choices = list(setting.choices)
    if not choices and setting.name in _NAMED and setting.kind == "text":
        choices = sorted(plugins.offers(_NAMED[setting.name]))
    return {
        "name": setting.name,
        "label": setting.name.replace("_", " "),
        "kind": "choice" if choices else setting.kind,
        "value": _written(value),
        "help": setting.help,
        "unit": setting.unit,
        "low": setting.low if setting.low is not None else setting.above,
        "high": setting.high,
        "choices": choices,
        "optional": setting.optional,
    }


def _written(value: Any) -> Any:
    """A value as a field of a panel shows it."""
    if isinstance(value, (tuple, list)):
        return ", ".join(str(part) for part in value)
    return round(value, 6) if isinstance(value, float) else value


def _read(setting: Setting, value: Any) -> Any:
    """What a field of a panel holds, as the setting wants it. Raises InvalidInput."""
    if setting.optional and value in (None, ""):
        return None
    if setting.kind == "flag":
        return bool(value)
    if setting.kind in ("texts", "numbers", "vector"):
        parts = [part.strip() for part in str(value or "").split(",") if part.strip()]
        return tuple(parts) if setting.kind == "texts" else tuple(_number(setting, part) for part in parts)
    if setting.kind == "number":
        return _number(setting, value)
    if setting.kind == "count":
        number = _number(setting, value)
        return int(number) if number == int(number) else number
    return value


def _number(setting: Setting, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InvalidInput(f"{setting.name} is a number, but got {str(value)[:40]!r}.") from None


def report(meets: list[Residual], document: ContactDocument) -> dict[str, Any]:
    """The state of the grasp in words, the worst contacts first."""
    rows = [
        {
            "pair": each.pair,
            "patch": each.patches[0],
            "words": each.words(),
            "level": each.level,
            "color": hexed(document.patch(each.patches[0]).color),
        }
        for each in meets
    ]
    bad = sum(each.level == 2 for each in meets)
    fair = sum(each.level == 1 for each in meets)
    if not meets:
        head = "No pairs yet."
    elif bad:
        head = f"{bad} of {len(meets)} contacts miss."
    elif fair == len(meets):
        head = f"All {fair} contacts nearly touch." if fair > 1 else "The contact nearly touches."
    elif fair:
        head = f"{len(meets) - fair} of {len(meets)} contacts touch, the others nearly."
    else:
        head = f"All {len(meets)} contacts touch."
    return {"head": head, "rows": rows}


def legend() -> list[dict[str, str]]:
    """The colours of the heat map with what they mean."""
    return [{"color": hexed(stop.color), "text": stop.text} for stop in LEGEND]


def next_step(session: Session, interaction: Interaction) -> str:
    """What to do next, for somebody who begins; "" once there is a pose."""
    document = session.document
    if not document.surfaces:
        return "Open a hand and an object: drop files here, or press Ctrl+O."
    tools = {action.id: action.keys[0] for action in interaction.actions if action.group == "tool" and action.keys}
    if not document.patches:
        key = tools.get("tool.paint", "")
        return f"Paint where the hand shall touch: press {key or 'the brush'} and drag over a finger."
    hands = {patch.surface for patch in document.patches.values()}
    if len(hands) < 2:
        key = tools.get("tool.transfer", "")
        return f"Bring the patch to the object: select it, press {key or 'Transfer'}, press on the object and drag."
    if not document.pairs:
        key = tools.get("tool.pair", "")
        return f"Say which patches meet: press {key or 'Pair'}, then drag from one to the other."
    if not document.poses:
        return "Press Space: the hand takes the object. Enter keeps the pose."
    return ""


def spelt_length(meters: float) -> str:
    """A length for people: "0.4 mm", "12 mm", "3.1 m"."""
    millimetres = 1000.0 * meters
    if millimetres < 10.0:
        return f"{millimetres:.1f} mm"
    return f"{millimetres:.0f} mm" if millimetres < 1000.0 else f"{meters:.1f} m"
