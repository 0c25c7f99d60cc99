"""What is asked of a plugin before it is let in, beyond what pluggy asks."""

from __future__ import annotations

import difflib
import inspect
import re
from typing import Any

from contact_core.plugins import hookspecs

HOOKS = tuple(name for name in vars(hookspecs) if name.startswith("contact_"))


def is_wrapper(options: Any) -> bool:
    """Whether hook options make a wrapper, of either of pluggy's two kinds."""
    return bool(options.get("wrapper") or options.get("hookwrapper"))


def hook_mistakes(plugin: object) -> list[str]:
    """What pluggy passes over in silence: misspelt hooks, forgotten marks, wrappers, and no hook at all."""
    mistakes, marked = [], False
    for name in dir(plugin):
        try:
            member = inspect.getattr_static(plugin, name)
        except AttributeError:
            continue
        options = getattr(member, "contact_impl", None)
        if options is None:
            if name in HOOKS and callable(getattr(plugin, name)):
                mistakes.append(f"{name} is not marked with @hookimpl, so it is never called.")
            continue
        marked = True
        if (options.get("specname") or name) not in HOOKS:
            near = difflib.get_close_matches(name, HOOKS, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(HOOKS)}."
            mistakes.append(f"there is no hook {name}; {hint}")
        elif is_wrapper(options):
            mistakes.append(f"{name} is a hook wrapper; wrappers are not called here.")
    return mistakes if mistakes or marked else [_nothing(plugin)]


def _nothing(plugin: object) -> str:
    """That a plugin has no hook; where its author put them into a class, what makes that work."""
    for name, member in getattr(plugin, "__dict__", {}).items():
        if isinstance(member, type) and any(hasattr(each, "contact_impl") for each in vars(member).values()):
            module = getattr(plugin, "__name__", "module")
            return (
                f"has hooks in the class {name} alone: put the functions, without self, at the top of the module,"
                f' or let the entry point say "{module}:{name}".'
            )
    return f"has no hook: expected a function marked with @hookimpl; there are: {', '.join(HOOKS)}."


def api_refusal(plugin: object) -> str | None:
    """Why a plugin made for another version of the hooks is skipped; it says CONTACT_API = ">=1.0,<2"."""
    wanted = getattr(plugin, "CONTACT_API", None)
    if wanted is None:
        return None
    has = ".".join(map(str, hookspecs.API_VERSION))
    for word in str(wanted).split(","):
        match = re.fullmatch(r"\s*(>=|<=|==|>|<)\s*(\d+)(?:\.(\d+))?\s*", word)
        if match is None:
            return f'sets CONTACT_API = {wanted!r}: expected a range such as ">=1.0,<2".'
        bound = (int(match[2]), int(match[3] or 0))
        mine = hookspecs.API_VERSION
        holds = {
            ">=": mine >= bound,
            "<=": mine <= bound,
            "==": mine == bound,
            ">": mine > bound,
            "<": mine < bound,
        }
        if not holds[match[1]]:
            return f"is made for plugin API {wanted}, but this is {has}; look for another version of it."
    return None
