"""The manager bears every broken plugin: the program goes on and the record names the plugin and the reason."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import pytest

import contact_builtins
from contact_core.errors import InvalidInput
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager, PluginRecord
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES, CLI, PLACERS, POSE_SOLVERS, POSE_TERMS
from contact_core.plugins.slot import SLOTS
from contact_core.settings import HasSettings, setting
from contact_core.solve.penetration import PenetrationTerm


class Named:
    """A sound placer."""

    summary = "does nothing at all"

    def __init__(self, name: str, replaces: str | tuple[str, ...] = ()) -> None:
        self.name = name
        self.replaces = replaces

    def place(self, request: Any) -> Any:
        return request


def plugin(*placers: object, name: str = "given", **attributes: Any) -> ModuleType:
    """A plugin module that offers these placers."""
    module = ModuleType(name)
    module.contact_placers = hookimpl(_returning(list(placers)))  # type: ignore[attr-defined]
    for key, value in attributes.items():
        setattr(module, key, value)
    return module


def _returning(value: Any) -> Any:
    def contact_placers() -> Any:
        return value

    return contact_placers


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Install a distribution `name` whose one module holds `source`, as its entry point."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(name: str, source: str, *, entry: str | None = None) -> None:
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        info = tmp_path / f"{name}-2.1.dist-info"
        info.mkdir()
        info.joinpath("METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 2.1\n")
        info.joinpath("entry_points.txt").write_text(f"[contact_core.plugins]\n{name} = {entry or name}\n")

    return write


def record_of(manager: PluginManager, name: str) -> PluginRecord:
    manager.fill_all()
    return next(record for record in manager.records() if record.name == name)


OFFER = """
from contact_core.plugins import hookimpl
class Mine:
    name = "mine"
    summary = "a sound placer"
    def place(self, request): return request
"""

BROKEN = {
    "import_error": ("import no_such_module_anywhere\n", "No module named 'no_such_module_anywhere'"),
    "syntax_error": ("def (:\n", "cannot be imported: SyntaxError"),
    "exits": ("import sys; sys.exit(3)\n", "cannot be imported: SystemExit: 3"),
    "of_old": ("from contact_core.solve.terms import Gone\n", "CHANGELOG.md says what was renamed"),
    "of_older": ("import contact_core.gone\n", "CHANGELOG.md says what was renamed"),
    "misspelt": (OFFER + "@hookimpl\ndef contact_placer(): return [Mine()]\n", "did you mean contact_placers?"),
    "unmarked": (OFFER + "def contact_placers(): return [Mine()]\n", "not marked with @hookimpl"),
    "wrapper": (OFFER + "@hookimpl(wrapper=True)\ndef contact_placers():\n    yield\n", "wrappers are not called"),
    "argument": (OFFER + "@hookimpl\ndef contact_placers(scene): return []\n", "'scene'"),
    "raises": (OFFER + "@hookimpl\ndef contact_placers(): raise RuntimeError('boom')\n", "RuntimeError: boom"),
    "no_list": (
        OFFER + "@hookimpl\ndef contact_placers(): return 7\n",
        "must return an iterable, but returned int",
    ),
    "wrong_type": (
        OFFER + "@hookimpl\ndef contact_placers(): return [object()]\n",
        "has no name; has no summary; has no place()",
    ),
    "unnamed": (OFFER + "Mine.name = ''\n@hookimpl\ndef contact_placers(): return [Mine]\n", "a non-empty string"),
    "signature": (
        OFFER + "Mine.place = lambda self: 0\n@hookimpl\ndef contact_placers(): return [Mine]\n",
        "cannot be called as place(request)",
    ),
    "constructor": (
        OFFER + "Mine.__init__ = lambda self, size: None\n@hookimpl\ndef contact_placers(): return [Mine]\n",
        "cannot be made: TypeError",
    ),
    "reference": (OFFER + "@hookimpl\ndef contact_placers(): return ['reference:Mein']\n", "it has Mine"),
    "spelling": (OFFER + "@hookimpl\ndef contact_placers(): return ['reference.Mine']\n", "package.module:Name"),
    "future": (OFFER + "CONTACT_API = '>=2.0'\n@hookimpl\ndef contact_placers(): return [Mine]\n", "API >=2.0"),
    "range": (OFFER + "CONTACT_API = 'new'\n@hookimpl\ndef contact_placers(): return [Mine]\n", '">=1.0,<2"'),
    "no_exception": (
        "class Skipped(BaseException): pass\nraise Skipped('no screen')\n",  # as pytest.importorskip raises
        "cannot be imported: Skipped: no screen",
    ),
    "hook_no_exception": (
        OFFER + "class Out(BaseException): pass\n@hookimpl\ndef contact_placers(): raise Out('now')\n",
        "its hook contact_placers raised Out: now",
    ),
    "no_hook": ("answer = 42\n", "has no hook: expected a function marked with @hookimpl"),
    "in_a_class": (
        OFFER + "class Plugin:\n    @hookimpl\n    def contact_placers(self): return [Mine]\n",
        'let the entry point say "in_a_class:Plugin"',
    ),
    "evil_module": (
        "def __getattr__(name): raise RuntimeError('no ' + name)\n",
        "cannot be looked at: RuntimeError",
    ),
    "evil_range": (
        OFFER + "class Range:\n    def __str__(self): raise ValueError('mute')\nCONTACT_API = Range()\n",
        "cannot be looked at: ValueError: mute",
    ),
    "evil_object": (
        OFFER + "class Evil:\n    def __getattr__(self, name): raise RuntimeError('no ' + name)\n"
        "@hookimpl\ndef contact_placers(): return [Evil()]\n",
        "its placer 'Evil' cannot be made: RuntimeError: no name",
    ),
    "mute_error": (
        OFFER + "class Mute(Exception):\n    def __str__(self): raise ValueError\n"
        "@hookimpl\ndef contact_placers(): raise Mute\n",
        "raised Mute.",
    ),
    "without_end": (
        OFFER + "import itertools\n@hookimpl\ndef contact_placers(): return itertools.repeat(7)\n",
        "goes on after 1000 offers",
    ),
    "one_string": (OFFER + "@hookimpl\ndef contact_placers(): return 'a:B'\n", "returned str; put it in a list"),
    "unprintable": (
        OFFER + "Mine.name = 'red\\x1b[31m'\n@hookimpl\ndef contact_placers(): return [Mine]\n",
        r"printable letters, but has 'red\x1b[31m'",
    ),
    "blank": (OFFER + "Mine.name = ' '\n@hookimpl\ndef contact_placers(): return [Mine]\n", "but has ' '"),
    "replaces_number": (
        OFFER + "Mine.replaces = 5\n@hookimpl\ndef contact_placers(): return [Mine]\n",
        "its placer 'Mine' cannot be made: TypeError",
    ),
    "host_that_opens_nothing": (
        OFFER + "class Host:\n    name = 'h'\n    summary = 's'\n    suffixes = ()\n    def space(self): ...\n"
        "@hookimpl\ndef contact_hosts(): return [Host]\n",
        "has no open()",
    ),
    "host_that_opens_no_path": (
        OFFER + "class Host:\n    name = 'h'\n    summary = 's'\n    suffixes = ()\n    def space(self): ...\n"
        "    @classmethod\n    def open(cls): ...\n"
        "@hookimpl\ndef contact_hosts(): return [Host]\n",
        "open() cannot be called as open(path)",
    ),
    "host_object": (
        OFFER + "class Host:\n    name = 'h'\n    def space(self): ...\n"
        "@hookimpl\ndef contact_hosts(): return [Host()]\n",
        "is an object where a class is expected",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_distribution_is_named_and_stops_nobody(install: Any, name: str) -> None:
    source, complaint = BROKEN[name]
    install(name, source)
    install("zz_sound", OFFER.replace('"mine"', '"sound"') + "@hookimpl\ndef contact_placers(): return [Mine]\n")
    manager = PluginManager(environ={})
    record = record_of(manager, name)
    assert record.source == f"{name} 2.1" or record.source == f"{name.replace('_', '-')} 2.1"
    assert complaint in " ".join(record.problems), record.problems
    assert not record.offers
    assert "sound" in manager.offers(PLACERS)
    assert not record_of(manager, "zz_sound").problems


def test_the_entry_point_may_be_a_class(install: Any) -> None:
    methods = "class Plugin:\n    @hookimpl\n    def contact_placers(self): return [Mine]\n"
    install("with_class", OFFER + methods, entry="with_class:Plugin")
    record = record_of(PluginManager(environ={}), "with_class")
    assert not record.problems and record.offers == {"placer": ["mine"]}


def test_an_entry_point_that_cannot_be_parsed_is_named(install: Any, tmp_path: Path) -> None:
    install("garbled", "")
    text = "[contact_core.plugins]\nthis is no line of it\n"
    (tmp_path / "garbled-2.1.dist-info" / "entry_points.txt").write_text(text)
    record = record_of(PluginManager(environ={}), "garbled")
    assert record.source == "garbled 2.1" and "entry_points.txt cannot be read" in record.problems[0]


HOOK = "from contact_core.plugins import hookimpl\n@hookimpl\n"


def offering(hook: Callable[[], Any]) -> ModuleType:
    module = ModuleType("busy")
    module.contact_placers = hookimpl(hook)  # type: ignore[attr-defined]
    return module


def test_only_the_user_interrupts() -> None:
    """Ctrl+C while a plugin is at work ends the program, as everywhere."""
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it in the background
    try:
        with pytest.raises(KeyboardInterrupt):
            PluginManager([offering(lambda: signal.raise_signal(signal.SIGINT))], discover=False)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, inherited)


@pytest.mark.parametrize("place", ["import", "hook"])
def test_a_plugin_that_raises_keyboard_interrupt_is_not_the_user(install: Any, place: str) -> None:
    hook = HOOK + "def contact_placers(): raise KeyboardInterrupt\n"
    install(f"impostor_{place}", "raise KeyboardInterrupt" if place == "import" else hook)
    plugins = PluginManager(environ={})
    plugins.fill_all()
    assert any("KeyboardInterrupt" in problem for problem in record_of(plugins, f"impostor_{place}").problems)


@pytest.mark.parametrize("place", ["import", "hook"])
def test_a_lowered_recursion_limit_is_restored_and_told(install: Any, place: str) -> None:
    """As low as Python allows where the plugin stands."""
    lower = (
        "import sys\n"
        "def lower():\n"
        "    for limit in range(5, 1000):\n"
        "        try: return sys.setrecursionlimit(limit)\n"
        "        except RecursionError: pass\n"
    )
    hook = HOOK + "def contact_placers(): lower(); return []\n"
    install(f"deep_{place}", lower + ("lower()\n" if place == "import" else hook))
    limit = sys.getrecursionlimit()
    try:
        plugins = PluginManager(environ={})
        plugins.fill_all()
        assert sys.getrecursionlimit() == limit
    finally:
        sys.setrecursionlimit(limit)
    assert any("lowered the recursion limit" in problem for problem in record_of(plugins, f"deep_{place}").problems)


def test_a_name_to_replace_that_nobody_has_is_a_problem(install: Any) -> None:
    hook = "@hookimpl\ndef contact_placers(): return [Mine]\n"
    install("aa_base", OFFER + hook)
    install("over", OFFER + "Mine.name, Mine.replaces = 'new', 'mien'\n" + hook)
    problems = record_of(PluginManager(environ={}), "over").problems
    assert len(problems) == 1 and "replaces 'mien'" in problems[0] and "did you mean 'mine'?" in problems[0]


def test_asking_for_what_a_missing_library_would_bring_says_so(install: Any) -> None:
    install("needy", OFFER + "@hookimpl\ndef contact_placers(): return ['needy_part:Mine']\n")
    install("needy_part", "from contact_core.errors import MissingExtra\nraise MissingExtra('Magic', 'viewer')\n")
    manager = PluginManager(environ={"CONTACT_PLUGINS": "no:needy_part"})
    with pytest.raises(InvalidInput, match=r"no placer 'mine'.*contact-core\[viewer\]"):
        manager.get(PLACERS, "mine")


def test_a_missing_optional_library_is_no_problem(install: Any) -> None:
    source = "from contact_core.errors import MissingExtra\ndef Mine(): raise MissingExtra('Magic', 'viewer')\n"
    install("poor", OFFER + "@hookimpl\ndef contact_placers(): return ['poor_part:Mine', Mine]\n")
    install("poor_part", source.replace("def Mine(): ", ""))
    record = record_of(PluginManager(environ={"CONTACT_PLUGINS": "no:poor_part"}), "poor")
    assert not record.problems and record.offers == {"placer": ["mine"]}
    assert 'pip install "contact-core[viewer]"' in record.absent[0]


def test_what_a_generator_gave_before_it_raised_stays() -> None:
    def contact_placers() -> Iterator[object]:
        yield Named("early")
        raise RuntimeError("late")

    source = ModuleType("half")
    source.contact_placers = hookimpl(contact_placers)  # type: ignore[attr-defined]
    manager = PluginManager(discover=False)
    with pytest.raises(InvalidInput, match="RuntimeError: late"):
        manager.register(source)
    assert not manager.records()


def test_duplicate_names_are_refused_naming_both(install: Any) -> None:
    hook = "@hookimpl\ndef contact_placers(): return [Mine]\n"
    install("first_one", OFFER + hook)
    install("second_one", OFFER + hook)
    manager = PluginManager(environ={})
    problems = " ".join(record_of(manager, "second_one").problems)
    assert "'first_one' (first-one 2.1)" in problems and 'replaces = "mine"' in problems
    assert not record_of(manager, "first_one").problems
    assert type(manager.get(PLACERS, "mine")).__module__ == "first_one"


def test_replaces_takes_the_place_and_the_name() -> None:
    base = plugin(Named("plain"), Named("other"), name="base")
    manager = PluginManager([base], discover=False)
    dispose = manager.register(plugin(Named("better", replaces="plain"), name="over"))
    assert manager.get(PLACERS, "plain").name == "better" and manager.get(PLACERS, "other").name == "other"
    dispose()
    assert manager.get(PLACERS, "plain").name == "plain" and "better" not in manager.offers(PLACERS)


def test_replaces_may_be_said_when_registering() -> None:
    manager = PluginManager([plugin(Named("plain"), name="base")], discover=False)
    new = Named("plain")
    with pytest.raises(InvalidInput, match="offers one of that name already"):
        manager.register(plugin(new, name="refused"))
    assert [record.name for record in manager.records()] == ["base"]
    manager.register(plugin(new, name="over"), replaces=["plain"])
    assert manager.get(PLACERS, "plain") is new


def test_precedence_session_environment_entry_point_built_in(install: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    hook = "Mine.replaces = 'mine'\nMine.origin = __name__\n@hookimpl\ndef contact_placers(): return [Mine]\n"
    install("by_entry", OFFER + hook)
    install("by_variable", OFFER + hook, entry="no_such_entry_module")
    manager = PluginManager(environ={"CONTACT_PLUGINS": "by_variable"})
    origins = [record.origin for record in manager.records()]
    assert origins == sorted(origins, key=["built-in", "entry point", "environment", "session"].index)
    assert {"built-in", "entry point", "environment"} <= set(origins)
    assert manager.get(PLACERS, "mine").origin == "by_variable"  # type: ignore[attr-defined]
    session = Named("mine", replaces="mine")
    manager.register(plugin(session, name="here"))
    assert manager.get(PLACERS, "mine") is session


def test_the_variable_leaves_plugins_out_and_names_failures() -> None:
    manager = PluginManager(environ={"CONTACT_PLUGINS": "no:builtins, no_such_module"})
    names = [record.name for record in manager.records()]
    assert "builtins" not in names
    assert record_of(manager, "no_such_module").source == "CONTACT_PLUGINS=no_such_module"
    assert record_of(manager, "no_such_module").problems


def test_an_environment_that_is_given_stands_for_the_process_s_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONTACT_PLUGINS", "no_such_module")
    assert "no_such_module" in {record.name for record in PluginManager().records()}
    assert "no_such_module" not in {record.name for record in PluginManager(environ={}).records()}


def test_without_discovery_only_what_is_given_is_there() -> None:
    manager = PluginManager([plugin(Named("only"))], discover=False)
    assert [record.name for record in manager.records()] == ["given"]
    assert list(manager.offers(PLACERS)) == ["only"]


def test_asking_for_what_is_not_there_lists_what_is() -> None:
    manager = PluginManager([plugin(Named("naive"), Named("from_pose"))], discover=False)
    with pytest.raises(InvalidInput, match=r"no placer 'form_pose'; there are: from_pose, naive\."):
        manager.get(PLACERS, "form_pose")
    with pytest.raises(InvalidInput, match=r"no sub-command 'usd'; there are: none\."):
        manager.get(CLI, "usd")


def test_references_are_imported_only_when_their_slot_is_asked_for(install: Any) -> None:
    install("lazy_part", OFFER)
    install("lazy_front", OFFER + "@hookimpl\ndef contact_placers(): return ['lazy_part:Mine']\n")
    manager = PluginManager(environ={"CONTACT_PLUGINS": "no:lazy_part"})
    manager.offers(CLI)
    assert "lazy_part" not in sys.modules
    assert manager.get(PLACERS, "mine").name == "mine"
    assert "lazy_part" in sys.modules


def test_choosing_takes_the_first_answer_that_is_offered() -> None:
    def choosing(name: str, answer: object) -> ModuleType:
        def contact_choose_pose_solver(offered: Any) -> Any:
            if isinstance(answer, Exception):
                raise answer
            return answer

        module = ModuleType(name)
        module.contact_choose_pose_solver = hookimpl(contact_choose_pose_solver)  # type: ignore[attr-defined]
        return module

    manager = PluginManager(
        [choosing("low", "a"), choosing("none", None), choosing("odd", "z"), choosing("bad", ValueError("no"))],
        discover=False,
    )
    assert manager.choose("contact_choose_pose_solver", ["a", "b"], problem=None) == "a"
    problems = {record.name: record.problems for record in manager.records()}
    assert "chose 'z', which is not among a, b" in problems["odd"][0]
    assert "raised ValueError: no" in problems["bad"][0]
    manager.register(choosing("high", "b"))
    assert manager.choose("contact_choose_pose_solver", ["a", "b"], problem=None) == "b"
    assert PluginManager(discover=False).choose("contact_choose_pose_solver", ["a"], problem=None) is None


def test_telling_reaches_everybody_even_past_one_that_raises() -> None:
    heard: list[tuple[str, int]] = []

    def listening(name: str, fails: bool) -> ModuleType:
        def contact_document_changed(revision: int) -> None:
            if fails:
                raise RuntimeError("deaf")
            heard.append((name, revision))

        module = ModuleType(name)
        module.contact_document_changed = hookimpl(contact_document_changed)  # type: ignore[attr-defined]
        return module

    manager = PluginManager([listening("a", False), listening("b", True), listening("c", False)], discover=False)
    for revision in (1, 2):
        manager.notify("contact_document_changed", document=None, revision=revision, origin="test")
    assert heard == [("a", 1), ("c", 1), ("a", 2), ("c", 2)]
    assert record_of(manager, "b").problems == ["its hook contact_document_changed raised RuntimeError: deaf."]


def test_the_built_ins_have_no_problem_and_fill_every_slot_that_is_theirs() -> None:
    manager = PluginManager(environ={})
    record = record_of(manager, "builtins")
    assert record.origin == "built-in" and record.problems == []
    wanted = {slot.noun for slot in SLOTS.values() if not slot.core} - {"host"}
    assert wanted <= {noun for each in manager.records() if each.origin == "built-in" for noun in each.offers}


@dataclass(frozen=True)
class Reaching(HasSettings):
    """A placer with a setting."""

    name: ClassVar[str] = "reaching"
    summary: ClassVar[str] = "goes as far as told"
    default_for: ClassVar[str] = "settle"
    reach: float = setting(0.5, low=0.0, high=1.0, unit="mm", help="how far it reaches")

    def place(self, request: Any) -> Any:
        return self.reach


def test_objects_are_made_with_checked_settings() -> None:
    manager = PluginManager([plugin(Reaching, Named("plain"))], discover=False)
    assert manager.make(PLACERS, "reaching", reach=1).place(None) == 1.0  # type: ignore[arg-type]
    assert manager.get(PLACERS, "reaching") == manager.make(PLACERS, "reaching") == Reaching()
    with pytest.raises(InvalidInput, match=r"the placer 'reaching': reach is at most 1 mm, but got 2\."):
        manager.make(PLACERS, "reaching", reach=2)
    with pytest.raises(InvalidInput, match=r"the placer 'plain' has no setting 'reach'; its settings: none\."):
        manager.make(PLACERS, "plain", reach=1)
    with pytest.raises(InvalidInput, match="no placer 'other'"):
        manager.make(PLACERS, "other")
    (only,) = manager.settings_of(PLACERS, "reaching")
    assert (only.name, only.unit, only.default) == ("reach", "mm", 0.5)
    assert manager.settings_of(PLACERS, "plain") == ()


def test_a_term_is_made_anew_for_every_problem() -> None:
    """The slot holds classes: nothing that is registered is taken apart to make another."""
    manager = PluginManager([contact_builtins], discover=False)
    one, two = (manager.make(POSE_TERMS, "penetration", weight=weight, solids={}) for weight in (1.0, 2.0))
    assert (one.weight, two.weight) == (1.0, 2.0) and manager.get(POSE_TERMS, "penetration") is PenetrationTerm
    with pytest.raises(InvalidInput, match="'penetration': weight is at least 0"):
        manager.make(POSE_TERMS, "penetration", weight=-1.0)
    with pytest.raises(InvalidInput, match="an object where a class is expected"):
        PluginManager(discover=False).register(_Terms())


class _Terms:
    @hookimpl
    def contact_pose_terms(self) -> list[object]:
        return [PenetrationTerm()]


def test_the_core_asks_for_roles_and_names_no_plugin() -> None:
    class Heir(Reaching):
        name: ClassVar[str] = "heir"

    manager = PluginManager([plugin(Named("first"), Reaching, Heir)], discover=False)
    assert manager.name_for(PLACERS, "settle") == "reaching"  # what Reaching says is not said by its heirs
    assert manager.name_for(PLACERS, "settle", "first") == "first"
    with pytest.raises(InvalidInput, match="no placer is the default for 'recipe': name one; there are: first"):
        manager.name_for(PLACERS, "recipe")
    manager.register(plugin(Mine := dataclass(frozen=True)(type("Mine", (Reaching,), MINE)), name="studio"))
    assert manager.name_for(PLACERS, "settle") == "mine" and manager.get(PLACERS, "mine") == Mine()
    with pytest.raises(InvalidInput, match="default_for 'lunch'; a placer may be that for: settle, recipe"):
        manager.register(plugin(type("Odd", (Reaching,), {"name": "odd", "default_for": "lunch"}), name="odd"))


MINE = {"name": "mine", "default_for": "settle", "__annotations__": {}}


def test_what_takes_a_place_takes_its_role() -> None:
    manager = PluginManager([plugin(Reaching)], discover=False)
    manager.register(plugin(Named("better", replaces="reaching"), name="studio"))
    assert manager.get(PLACERS, manager.name_for(PLACERS, "settle")).name == "better"


def test_every_built_in_has_a_summary_and_sound_settings() -> None:
    manager = PluginManager(environ={})
    for slot in (BRUSHES, AXIS_GENERATORS, PLACERS, POSE_SOLVERS, POSE_TERMS):
        for name, made in manager.offers(slot).items():
            assert len(made.summary.split()) >= 3, (slot.noun, name)
            for each in manager.settings_of(slot, name):
                assert len(each.help.split()) >= 3 and each.checked(each.default) == each.default
        for role in slot.roles:
            assert manager.name_for(slot, role) in manager.offers(slot)
