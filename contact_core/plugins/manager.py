"""The tolerant plugin manager: what a plugin does wrong is written down with its name, and never stops the program.

pluggy validates and keeps the hook implementations; each is called by itself, inside a `try`, so that one that
raises takes nobody else down. A manager belongs to a session and is never a module's global.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, TypeVar, overload

import pluggy

from contact_core.errors import InvalidInput
from contact_core.plugins import hookspecs
from contact_core.plugins.checks import api_refusal, hook_mistakes, is_wrapper
from contact_core.plugins.discovery import Candidate, discovered
from contact_core.plugins.record import Offer, PluginRecord
from contact_core.plugins.slot import SLOTS, Slot, resolve, roles_of, shortcomings
from contact_core.settings import Setting, configured, settings_of

T = TypeVar("T")
U = TypeVar("U")
MOST_OFFERS = 1_000  # of one hook of one plugin: a generator without an end must not hang the program

__all__ = ["PluginManager", "PluginRecord"]


class PluginManager:
    """The plugins of one session.

    plugins: modules or objects with hook implementations, of highest precedence.  discover: whether entry points
    and CONTACT_PLUGINS are read; tests say False.  Precedence: session > CONTACT_PLUGINS > entry point > built-in.
    """

    def __init__(
        self, plugins: Iterable[object] = (), *, discover: bool = True, environ: Mapping[str, str] | None = None
    ) -> None:
        self._pluggy = pluggy.PluginManager("contact")
        self._pluggy.add_hookspecs(hookspecs)
        self._records: dict[str, PluginRecord] = {}  # lowest precedence first
        self._filled: dict[str, Mapping[str, Any]] = {}  # hook -> objects by name
        self._factories: dict[str, dict[str, Any]] = {}  # hook -> what makes them, by name
        self._roles: dict[str, dict[str, tuple[str, ...]]] = {}  # hook -> what they are the default for, by name
        for candidate in discovered(environ) if discover else ():
            self._try(candidate)
        for plugin in plugins:
            self.register(plugin)

    def register(
        self, plugin: object, name: str | None = None, *, replaces: Iterable[str] = ()
    ) -> Callable[[], None]:
        """Add a plugin with the highest precedence; returns the function that takes it out again.

        plugin: a module, an object, or a class, which is called without arguments. replaces: names of objects
        whose place this plugin's objects take. Unlike a discovered plugin, one that is handed over by a program is
        refused at once, with InvalidInput, for anything that is wrong with it.
        """
        name = name or _name_of(plugin)
        if name in self._records:
            raise InvalidInput(f"a plugin named {name!r} is registered already ({self._records[name].source}).")
        record = PluginRecord(name, "session", "this session", replaces=tuple(replaces))
        self._admit(record, lambda: plugin)
        for slot in SLOTS.values():
            if record.plugin is not None and hasattr(record.plugin, slot.hook):
                self.offers(slot)
        if record.problems:
            self._remove(name)
            raise InvalidInput(f"the plugin {name!r} cannot be used: " + " ".join(record.problems))
        return lambda: self._remove(name)

    def offers(self, slot: Slot[T]) -> Mapping[str, T]:
        """Everything offered for a slot, by name. The first call imports what the references point to."""
        if slot.hook not in self._filled:
            self._filled[slot.hook] = MappingProxyType(self._fill(slot))
        return self._filled[slot.hook]

    def get(self, slot: Slot[T], name: str) -> T:
        """One object by name; raises InvalidInput that lists what exists and what failed to load."""
        offers = self.offers(slot)
        if name in offers:
            return offers[name]
        near = difflib.get_close_matches(name, offers, n=3)
        near += sorted(other for other in offers if other not in near)  # all of them, the likeliest first
        records = self._records.values()
        absent = [told for record in records for told in record.absent if told.startswith(f"{slot.noun} ")]
        failed = [record.name for record in records if record.problems]
        raise InvalidInput(
            f"there is no {slot.noun} {name!r}; there are: {', '.join(near) or 'none'}."
            + (f" Not available here: {' '.join(absent)}" if absent else "")
            + (f" Plugins with problems (see `contact plugins`): {', '.join(failed)}." if failed else "")
        )

    @overload
    def make(self, slot: Slot[type[U]], name: str, **settings: Any) -> U: ...
    @overload
    def make(self, slot: Slot[T], name: str, **settings: Any) -> T: ...
    def make(self, slot: Slot[Any], name: str, **settings: Any) -> Any:
        """An object by name, with settings and data by keyword.

        Raises InvalidInput as `get` does, and for a setting that it does not have or a value that it refuses.
        """
        self.get(slot, name)
        return configured(self._factories[slot.hook][name], settings, f"the {slot.noun} {name!r}")

    def settings_of(self, slot: Slot[Any], name: str) -> tuple[Setting, ...]:
        """The settings of an object, in its own order: what a panel shows. Raises InvalidInput as `get` does."""
        self.get(slot, name)
        return settings_of(self._factories[slot.hook][name])

    def name_for(self, slot: Slot[Any], role: str, name: str | None = None) -> str:
        """The name that was given; without one, that of the object which says `default_for = role`, of the highest
        precedence; the first offered where none does and it is the slot's `first_is`.

        Raises InvalidInput where there is none.
        """
        if name is not None:
            return name
        offers = self.offers(slot)
        declared = [key for key, roles in self._roles[slot.hook].items() if role in roles]
        if not declared and role == slot.first_is:
            declared = list(offers)[:1]
        if not declared:
            raise InvalidInput(
                f"no {slot.noun} is the default for {role!r}: name one; there are: {', '.join(offers) or 'none'}."
            )
        return declared[-1]

    def refuse(self, slot: Slot[Any], name: str, reason: str) -> None:
        """Take an object out that proved unsound when it was used; the reason is a problem of its plugin."""
        for record in self._records.values():
            kept = [offer for offer in record.collected.get(slot.hook, ()) if offer.name != name]
            if len(kept) < len(record.collected.get(slot.hook, ())):
                record.collected[slot.hook] = kept
                record.complain(f"its {slot.noun} {name!r} is refused: {reason}.")
        self._filled.pop(slot.hook, None)

    def choose(self, hook: str, offered: Iterable[str], **arguments: Any) -> str | None:
        """Ask a `contact_choose_*` hook, highest precedence first; an answer that is not `offered` is noted."""
        names = tuple(offered)
        for record in reversed(self._records.values()):
            answer = self._call(record, hook, {**arguments, "offered": names})
            if answer in names:
                return str(answer)
            if answer is not None:
                record.complain(f"{hook} chose {answer!r}, which is not among {', '.join(names)}.")
        return None

    def notify(self, hook: str, **arguments: Any) -> None:
        """Tell every plugin; what raises is written down."""
        for record in tuple(self._records.values()):
            self._call(record, hook, arguments)

    def records(self) -> tuple[PluginRecord, ...]:
        """Every plugin that was found, used or not, lowest precedence first."""
        return tuple(self._records.values())

    def fill_all(self) -> None:
        """Ask for every slot, so that `records` tells everything."""
        for slot in SLOTS.values():
            self.offers(slot)

    def _try(self, candidate: Candidate) -> None:
        """Import and admit a discovered plugin; on any failure, only its record stays."""
        name = candidate.name
        if name in self._records:
            name = f"{candidate.name} ({candidate.source})"
        self._admit(PluginRecord(name, candidate.origin, candidate.source), candidate.load)

    def _admit(self, record: PluginRecord, load: Callable[[], object]) -> None:
        """Load a plugin and register it with pluggy after the checks that pluggy leaves out."""
        self._records[record.name] = record
        self._filled.clear()
        with record.bearing("cannot be imported:"):  # a module may do anything while it is imported
            plugin = load()
            plugin = plugin() if isinstance(plugin, type) else plugin
            with record.bearing("cannot be looked at:"):  # and an object while its members are read
                refusal = api_refusal(plugin) or self._register(plugin, record.name)
                for sentence in [refusal] if refusal else hook_mistakes(plugin):
                    record.complain(sentence)
                record.plugin = None if refusal else plugin
        if record.plugin is None and self._pluggy.has_plugin(record.name):
            self._pluggy.unregister(name=record.name)  # older pluggy leaves half of it registered

    def _register(self, plugin: object, name: str) -> str | None:
        """Why pluggy refuses a plugin; None where it does not."""
        try:
            known = self._pluggy.register(plugin, name)
        except (ValueError, pluggy.PluginValidationError) as error:
            return " ".join(str(error).split()) + "."
        return "is not a plugin: expected a module or object, but got None." if known is None else None

    def _remove(self, name: str) -> None:
        if self._records.pop(name, None) is not None:
            self._filled.clear()
            if self._pluggy.has_plugin(name):
                self._pluggy.unregister(name=name)

    def _call(self, record: PluginRecord, hook: str, arguments: Mapping[str, Any]) -> Any:
        """One plugin's answer to one hook; None where it has no such hook or raises."""
        caller = getattr(self._pluggy.hook, hook)
        for implementation in caller.get_hookimpls():
            if implementation.plugin_name == record.name and not is_wrapper(implementation.opts):
                with record.bearing(f"its hook {hook} raised", f"{hook}: "):
                    return implementation.function(*(arguments[name] for name in implementation.argnames))
        return None

    def _collect(self, record: PluginRecord, slot: Slot[Any]) -> list[Offer]:
        """The sound objects that one plugin offers for a slot; each unsound one is written down."""
        answer = self._call(record, slot.hook, {})
        sound: list[Offer] = []
        if answer is None:
            return sound
        if isinstance(answer, str) or not isinstance(answer, Iterable):
            record.complain(
                f"its hook {slot.hook} must return an iterable, but returned {type(answer).__name__};"
                " put it in a list."
            )
            return sound
        with record.bearing(f"its hook {slot.hook} raised", f"{slot.noun} "):  # half-way: what came before stays
            for count, offered in enumerate(answer):
                if count == MOST_OFFERS:
                    record.complain(
                        f"its hook {slot.hook} goes on after {MOST_OFFERS} offers; the others are left out."
                    )
                    break
                sound += _examined(record, slot, offered)
        return sound

    def _fill(self, slot: Slot[Any]) -> dict[str, Any]:
        """Objects by name over all plugins, lowest precedence first, duplicates refused unless they replace."""
        filled: dict[str, Any] = dict(resolve(slot.core)) if slot.core else {}
        factories = self._factories[slot.hook] = dict(filled)
        roles: dict[str, tuple[str, ...]] = dict.fromkeys(filled, ())
        self._roles[slot.hook] = roles
        owner = dict.fromkeys(filled, "contact-core itself")
        for record in tuple(self._records.values()):
            if slot.hook not in record.collected:
                record.collected[slot.hook] = self._collect(record, slot)
            record.offers.pop(slot.noun, None)
            for name, made, factory, replaces in record.collected[slot.hook]:
                replaced = {*replaces, *record.replaces} & filled.keys()
                if name in filled and name not in replaced:
                    record.complain(
                        f"its {slot.noun} {name!r} is refused: {owner[name]} offers one of that name already;"
                        f' rename it, or set replaces = "{name}" on it.'
                    )
                    continue
                for nobody in set(replaces) - filled.keys() - {name}:
                    self._miss(record, slot, name, nobody, filled)
                for key in {name, *replaced}:
                    filled[key], factories[key] = made, factory
                    roles[key] = roles_of(made) or roles.get(key, ())  # of what it takes the place of
                    owner[key] = f"the plugin {record.name!r} ({record.source})"
                record.offers.setdefault(slot.noun, []).append(name)
        return filled

    def _miss(self, record: PluginRecord, slot: Slot[Any], name: str, nobody: str, filled: Iterable[str]) -> None:
        """Complain of `replaces` that names nothing; not where its library may be what is missing here."""
        if not any(told.startswith(f"{slot.noun} ") for each in self._records.values() for told in each.absent):
            near = difflib.get_close_matches(nobody, filled, n=1)
            record.complain(
                f"its {slot.noun} {name!r} replaces {nobody!r}, which no plugin before it offers"
                + (f"; did you mean {near[0]!r}?" if near else ".")
            )


def _examined(record: PluginRecord, slot: Slot[Any], offered: Any) -> list[Offer]:
    """What is behind an offer, in a list; none where it is unsound, which is written down."""
    label = offered if isinstance(offered, str) else repr(_type_of(offered).__qualname__)
    with record.bearing(f"its {slot.noun} {label} cannot be made:", f"{slot.noun} {label}: "):
        factory = resolve(offered) if isinstance(offered, str) else offered
        made = factory() if slot.instances and isinstance(factory, type) else factory
        lacks = shortcomings(made, slot)
        if not lacks:
            replaces = getattr(made, "replaces", ())
            words = (replaces,) if isinstance(replaces, str) else tuple(replaces)
            return [Offer(getattr(made, slot.key), made, factory, words)]
        record.complain(f"its {slot.noun} {label} is refused: {'; '.join(lacks)}.")
    return []


def _type_of(offered: Any) -> type:
    return offered if isinstance(offered, type) else type(offered)


def _name_of(plugin: object) -> str:
    name = getattr(plugin, "__name__", None)
    return name if isinstance(name, str) else type(plugin).__name__
