"""The tolerant plugin manager: what a plugin does wrong is written down with its name, and never stops the program.

pluggy validates and keeps the hook implementations; each is called by itself, inside a `try`, so that one that
raises takes nobody else down. A manager belongs to a session and is never a module's global.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeVar

import pluggy

from contact_core.errors import InvalidInput, MissingExtra
from contact_core.plugins import hookspecs
from contact_core.plugins.checks import api_refusal, hook_mistakes, is_wrapper
from contact_core.plugins.discovery import Candidate, Origin, discovered
from contact_core.plugins.registry import SLOTS, Slot, resolve, shortcomings

T = TypeVar("T")


@dataclass
class PluginRecord:
    """What is known of one plugin. source: distribution and version, or where else it came from.

    problems: sentences, empty when all is well.  absent: sentences on what a library that is not installed would
    bring; that is no problem.  offers: noun of a slot -> names, filled as slots are asked for.
    """

    name: str
    origin: Origin
    source: str
    plugin: object | None = None  # None: it could not be used at all
    replaces: tuple[str, ...] = ()
    problems: list[str] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)
    offers: dict[str, list[str]] = field(default_factory=dict)
    collected: dict[str, list[Any]] = field(default_factory=dict, repr=False)  # hook -> sound objects

    def complain(self, sentence: str) -> None:
        """Write a problem down, once."""
        if sentence not in self.problems:
            self.problems.append(sentence)


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
        for candidate in discovered(environ) if discover else ():
            self._try(candidate)
        for plugin in plugins:
            self.register(plugin)

    def register(
        self, plugin: object, name: str | None = None, *, replaces: Iterable[str] = ()
    ) -> Callable[[], None]:
        """Add a plugin with the highest precedence; returns the function that takes it out again.

        replaces: names of objects whose place this plugin's objects take. Unlike a discovered plugin, one that is
        handed over by a program is refused at once, with InvalidInput, for anything that is wrong with it.
        """
        name = name or _name_of(plugin)
        if name in self._records:
            raise InvalidInput(f"a plugin named {name!r} is registered already ({self._records[name].source}).")
        record = PluginRecord(name, "session", "this session", plugin, tuple(replaces))
        self._admit(record)
        for slot in SLOTS:
            if hasattr(plugin, slot.hook):
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
        near = difflib.get_close_matches(name, offers, n=3) or sorted(offers)
        failed = [record.name for record in self._records.values() if record.problems]
        raise InvalidInput(
            f"there is no {slot.noun} {name!r}; there are: {', '.join(near) or 'none'}."
            + (f" Plugins with problems (see `contact plugins`): {', '.join(failed)}." if failed else "")
        )

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
        for slot in SLOTS:
            self.offers(slot)

    def _try(self, candidate: Candidate) -> None:
        """Import and admit a discovered plugin; on any failure, only its record stays."""
        name = candidate.name
        if name in self._records:
            name = f"{candidate.name} ({candidate.source})"
        record = PluginRecord(name, candidate.origin, candidate.source)
        try:
            record.plugin = candidate.load()
        except (Exception, SystemExit) as error:  # a module may do anything while it is imported
            record.complain(f"cannot be imported: {_spell(error)}.")
            self._records[name] = record
            return
        self._admit(record)

    def _admit(self, record: PluginRecord) -> None:
        """Register with pluggy after the checks that pluggy leaves out."""
        self._records[record.name] = record
        self._filled.clear()
        refusal = api_refusal(record.plugin)
        if refusal is None:
            try:
                if self._pluggy.register(record.plugin, record.name) is None:
                    refusal = "is not a plugin: a module or object was wanted, but None came."
            except (ValueError, pluggy.PluginValidationError) as error:
                self._pluggy.unregister(name=record.name)  # older pluggy leaves half of it registered
                refusal = " ".join(str(error).split()) + "."
        if refusal:
            record.complain(refusal)
            record.plugin = None
        else:
            for sentence in hook_mistakes(record.plugin):
                record.complain(sentence)

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
                try:
                    return implementation.function(*(arguments[name] for name in implementation.argnames))
                except (Exception, SystemExit) as error:
                    record.complain(f"its hook {hook} raised {_spell(error)}.")
        return None

    def _collect(self, record: PluginRecord, slot: Slot[Any]) -> list[Any]:
        """The sound objects that one plugin offers for a slot; each unsound one is written down."""
        answer = self._call(record, slot.hook, {})
        sound: list[Any] = []
        if answer is None:
            return sound
        try:
            iterator = iter(answer)
        except TypeError:
            record.complain(f"its hook {slot.hook} must return an iterable, but returned {type(answer).__name__}.")
            return sound
        while True:  # a generator may raise half-way: what came before stays
            try:
                offered = next(iterator)
            except StopIteration:
                return sound
            except (Exception, SystemExit) as error:
                record.complain(f"its hook {slot.hook} raised {_spell(error)}.")
                return sound
            try:
                made = _made(offered, slot)
                lacks = shortcomings(made, slot)
            except MissingExtra as error:
                record.absent.append(f"{slot.noun} {_reference(offered)}: {error}")
                continue
            except (Exception, SystemExit) as error:
                record.complain(f"its {slot.noun} {_reference(offered)} cannot be made: {_spell(error)}.")
                continue
            if lacks:
                record.complain(f"its {slot.noun} {_reference(offered)} is refused: {'; '.join(lacks)}.")
            else:
                sound.append(made)

    def _fill(self, slot: Slot[Any]) -> dict[str, Any]:
        """Objects by name over all plugins, lowest precedence first, duplicates refused unless they replace."""
        filled: dict[str, Any] = {}
        owner: dict[str, PluginRecord] = {}
        for record in tuple(self._records.values()):
            if slot.hook not in record.collected:
                record.collected[slot.hook] = self._collect(record, slot)
            record.offers.pop(slot.noun, None)
            for made in record.collected[slot.hook]:
                name = getattr(made, slot.key)
                replaced = {*_words(getattr(made, "replaces", ())), *record.replaces} & filled.keys()
                if name in filled and name not in replaced:
                    record.complain(
                        f"its {slot.noun} {name!r} is refused: the plugin {owner[name].name!r}"
                        f" ({owner[name].source}) offers one of that name already;"
                        f' rename it, or set replaces = "{name}" on it.'
                    )
                    continue
                for key in {name, *replaced}:
                    filled[key], owner[key] = made, record
                record.offers.setdefault(slot.noun, []).append(name)
        return filled


def _made(offered: Any, slot: Slot[Any]) -> Any:
    """The object behind an offer: references are imported, classes called where the slot holds instances."""
    found = resolve(offered) if isinstance(offered, str) else offered
    return found() if slot.instances and isinstance(found, type) else found


def _reference(offered: Any) -> str:
    if isinstance(offered, str):
        return offered
    return repr(getattr(offered, "__qualname__", type(offered).__qualname__))


def _words(value: Any) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value)


def _name_of(plugin: object) -> str:
    name = getattr(plugin, "__name__", None)
    return name if isinstance(name, str) else type(plugin).__name__


def _spell(error: BaseException) -> str:
    """One line: the kind of the error and what it said."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": .")
