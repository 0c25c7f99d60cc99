"""What a slot is, the table of all of them, and what an object must have to fill one.

Here are names only, so that whatever finds and keeps plugins may know it and needs none of what they fill. Type
checkers are told beside a protocol what its slot holds: in `registry` for those of `slots` and of lower floors, in
`contact_core.grasping.slots`, and in `contact_core.interaction.tool`.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from contact_core.errors import InvalidInput
from contact_core.settings import declaration_mistakes, is_frozen_dataclass

T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class Slot(Generic[T_co]):
    """One kind of thing that plugins offer.

    hook: the hook that asks for it.  noun: what people call it.  protocol: "module:Name" of what it must satisfy.
    key: the attribute that names an object.  instances: whether the slot holds instances (else classes).
    core: "module:Name" of a mapping of what the core itself offers, beneath all plugins.  roles: what an object may
    be the default for, by its attribute `default_for`: the core names no plugin, it asks for the default of a role.
    first_is: the role for which the first offered stands where no object says so.  in_journal: whether a journal
    holds the fields of its objects, so that they have to be frozen dataclasses.
    """

    hook: str
    noun: str
    protocol: str
    key: str = "name"
    instances: bool = True
    core: str = ""
    roles: tuple[str, ...] = ()
    first_is: str = ""
    in_journal: bool = False


_ALL: tuple[Slot[Any], ...] = (
    Slot("contact_brushes", "brush", "contact_core.contact.brush:Brush"),
    Slot(
        "contact_axis_generators",
        "axis generator",
        "contact_core.contact.axis_generator:AxisGenerator",
        roles=("paint", "recipe"),
        first_is="paint",
    ),
    Slot("contact_placers", "placer", "contact_core.plugins.slots:Placer", roles=("settle", "recipe")),
    Slot(
        "contact_grasp_samplers",
        "grasp sampler",
        "contact_core.grasping.slots:GraspSampler",
        roles=("grasp",),
        first_is="grasp",
    ),
    Slot(
        "contact_grasp_scores",
        "grasp score",
        "contact_core.grasping.slots:GraspScore",
        roles=("grasp",),
        first_is="grasp",
    ),
    Slot(
        "contact_pose_solvers",
        "pose solver",
        "contact_core.solve.solver:PoseSolver",
        roles=("solve",),
        first_is="solve",
    ),
    Slot("contact_pose_terms", "pose term", "contact_core.solve.term:PoseTerm", instances=False, roles=("depth",)),
    Slot("contact_geodesic_engines", "geodesic engine", "contact_core.geometry.engine:GeodesicEngine"),
    Slot("contact_hosts", "host", "contact_core.scene.host:HostAdapter", instances=False),
    Slot("contact_tools", "tool", "contact_core.interaction.tool:Tool"),
    Slot("contact_formats", "format", "contact_core.plugins.slots:Format"),
    Slot("contact_renderers", "renderer", "contact_core.plugins.slots:Renderer", roles=("thumbnail",)),
    Slot("contact_samples", "sample", "contact_core.plugins.slots:Sample"),
    Slot(
        "contact_commands",
        "command",
        "contact_core.edit.command:Command",
        key="json_id",
        instances=False,
        core="contact_core.edit.command_table:BUILT_IN_COMMANDS",
        in_journal=True,
    ),
    Slot(
        "contact_job_kinds", "kind of job", "contact_core.plugins.slots:JobKind", core="contact_core.farm.kinds:OWN"
    ),
    Slot(
        "contact_proxy_makers",
        "proxy maker",
        "contact_core.plugins.slots:ProxyMaker",
        roles=("repair",),
        first_is="repair",
    ),
    Slot("contact_cli", "sub-command", "contact_core.plugins.slots:CliCommand"),
)
SLOTS: Mapping[str, Slot[Any]] = MappingProxyType({slot.hook: slot for slot in _ALL})


def resolve(reference: str) -> Any:
    """The object behind "package.module:Name". Raises InvalidInput for another spelling; import errors pass."""
    module, colon, name = reference.partition(":")
    if not colon or not module or not name:
        raise InvalidInput(f'a reference is spelt "package.module:Name", but got {reference!r}.')
    found = import_module(module)
    if not hasattr(found, name):
        near = difflib.get_close_matches(name, dir(found), n=3)
        raise InvalidInput(f"{module} has no {name!r}" + (f"; it has {', '.join(near)}." if near else "."))
    return getattr(found, name)


def shortcomings(candidate: object, slot: Slot[Any]) -> list[str]:
    """What keeps an object from filling a slot, in words; empty when nothing does."""
    result = []
    for name, member in _members(resolve(slot.protocol)).items():
        if not hasattr(candidate, name):
            if slot.instances or callable(member):  # a class need not show what its instances will hold
                result.append(f"has no {name}" + ("()" if callable(member) else ""))
        elif callable(member):
            takes_self = slot.instances and not inspect.ismethod(member)
            result += _call_shortcomings(name, member, getattr(candidate, name), bound=takes_self)
    if not slot.instances and not isinstance(candidate, type):
        result.append("is an object where a class is expected")
    result += declaration_mistakes(candidate)
    result += [
        f"is default_for {role!r}; a {slot.noun} may be that for: {', '.join(slot.roles) or 'nothing'}"
        for role in roles_of(candidate)
        if role not in slot.roles
    ]
    if slot.in_journal and not is_frozen_dataclass(candidate):
        result.append("is no frozen dataclass, whose fields a journal could hold")
    key = getattr(candidate, slot.key, None)
    if not (isinstance(key, str) and key and key.isprintable() and key == key.strip()):
        result.append(f"needs a {slot.key}, a non-empty string of printable letters, but has {key!a}")
    return result


def roles_of(candidate: object) -> tuple[str, ...]:
    """What an object says it is the default for; its own word, not that of a class which it derives from."""
    kind = candidate if isinstance(candidate, type) else type(candidate)
    roles = kind.__dict__.get("default_for", ())
    return (roles,) if isinstance(roles, str) else tuple(roles)


def _members(protocol: type) -> dict[str, Any]:
    """Public members of a protocol by name: its functions, its class methods as they are bound to it, and None for
    plain attributes and properties."""
    result: dict[str, Any] = {}
    for base in reversed(protocol.__mro__):
        if not getattr(base, "_is_protocol", False):
            continue
        for name in inspect.get_annotations(base):
            result.setdefault(name, None)
        for name, member in vars(base).items():
            if not name.startswith("_"):
                bound = getattr(protocol, name) if isinstance(member, classmethod) else None
                result[name] = member if inspect.isfunction(member) else bound
    return {name: member for name, member in result.items() if not name.startswith("_")}


def _call_shortcomings(name: str, wanted: Any, offered: Any, *, bound: bool) -> list[str]:
    """Whether `offered` can be called as the protocol's method is."""
    if not callable(offered):
        return [f"{name} is {type(offered).__name__}, not a method"]
    try:
        signature = inspect.signature(offered)
    except (TypeError, ValueError):  # a builtin without a signature: nothing to compare
        return []
    parameters = list(inspect.signature(wanted).parameters.values())[1 if bound else 0 :]
    positional = [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD and p.default is p.empty]
    keywords = {p.name: None for p in parameters if p.kind is p.KEYWORD_ONLY}
    try:
        signature.bind(*positional, **keywords)
    except TypeError as error:
        asked = ", ".join([*positional, *(f"{key}=" for key in keywords)])
        return [f"{name}{signature} cannot be called as {name}({asked}): {error}"]
    return []
