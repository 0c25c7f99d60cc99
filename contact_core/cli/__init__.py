"""The command line `contact`: a frame of sub-commands, some of them brought by plugins.

`--help` must answer at once, so this package and the modules that plugins register import nothing heavy at their
top; each command imports what it needs inside `run`. `run` finds the session's plugins in `arguments.plugins`
(PluginManager) and the way to answer in `arguments.output` (Output).
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
import warnings
from collections.abc import Mapping, Sequence

from contact_core._version import __version__
from contact_core.cli.output import Output
from contact_core.errors import ContactError
from contact_core.interrupts import sigterm_as_interrupt
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.record import spell
from contact_core.plugins.registry import CLI
from contact_core.plugins.slot import resolve
from contact_core.plugins.slots import CliCommand

_OWN = (
    "contact_core.cli.pose:Pose",
    "contact_core.cli.motion:Motion",
    "contact_core.cli.batch:Batch",
    "contact_core.cli.grasp:Grasp",
    "contact_core.cli.library:Library",
    "contact_core.cli.samples:Samples",
    "contact_core.cli.edits:History",
    "contact_core.cli.edits:Replay",
    "contact_core.cli.edits:Diff",
    "contact_core.cli.edits:Accept",
    "contact_core.cli.plugins:Plugins",
    "contact_core.cli.new_plugin:NewPlugin",
    "contact_core.cli.warm_up:WarmUp",
)


def main(argv: Sequence[str] | None = None, *, plugins: PluginManager | None = None) -> int:
    """Run `contact` with arguments (default: those of the process); returns the exit code.

    0: done. 1: done, and the answer is no (a check that failed). 2: a ContactError, told in one sentence on stderr.
    130: interrupted. 143: terminated. 141: whoever read the answer closed the pipe, as `head` does.
    """
    with sigterm_as_interrupt() as terminated:
        try:
            return _guarded(argv, plugins)
        except KeyboardInterrupt:
            Output.error("terminated." if terminated() else "interrupted.")
            return 143 if terminated() else 130


def _guarded(argv: Sequence[str] | None, plugins: PluginManager | None) -> int:
    """`_run`, with what goes wrong as a sentence and an exit code."""
    try:
        return _run(argv, plugins)
    except ContactError as error:
        Output.error(str(error))
    except BrokenPipeError:
        with contextlib.suppress(OSError):  # or Python complains when it flushes at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        Output.error(f"{error.filename or 'the system'}: {error.strerror or error}.")
    except MemoryError:
        Output.error("the memory of this machine does not suffice; try a smaller mesh or picture.")
    return 2


def _run(argv: Sequence[str] | None, plugins: PluginManager | None) -> int:
    stdout = sys.stdout
    as_json = "--json" in (sys.argv[1:] if argv is None else argv)
    # With --json the answer stands alone on standard output: what a plugin prints goes to stderr.
    with contextlib.redirect_stdout(sys.stderr) if as_json else contextlib.nullcontext():
        plugins = plugins or PluginManager()
        parser = _parser(_commands(plugins))
        with contextlib.redirect_stdout(stdout):  # --help and --version are answers, too
            arguments = parser.parse_args(argv)
        arguments.plugins = plugins
        output = Output(json=arguments.json, quiet=arguments.quiet, stdout=stdout)
        with output.closing(), warnings.catch_warnings():
            if not sys.warnoptions:  # the warnings of libraries are for programmers: python -W shows them
                warnings.simplefilter("ignore")
            arguments.output = output
            return int(arguments.command.run(arguments))


def _commands(plugins: PluginManager) -> Mapping[str, CliCommand]:
    """Sub-commands by name. A plugin's that takes the name of one of ours, or cannot be set up, is left out."""
    own: dict[str, CliCommand] = {command.name: command for command in (resolve(place)() for place in _OWN)}
    for name, command in plugins.offers(CLI).items():
        if name in own:
            plugins.refuse(CLI, name, "contact has a sub-command of that name itself; rename it")
            continue
        if not re.fullmatch(r"\w[\w.-]*", name):
            plugins.refuse(CLI, name, "nobody could type it; use letters, digits and hyphens")
            continue
        try:
            command.configure(argparse.ArgumentParser(parents=[_shared()]))
        except Exception as error:
            plugins.refuse(CLI, name, f"its arguments cannot be set up: {spell(error)}")
    return {**plugins.offers(CLI), **own}


def _shared() -> argparse.ArgumentParser:
    """The options that every sub-command has."""
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("--json", action="store_true", help="answer with one JSON document")
    shared.add_argument("--quiet", action="store_true", help="no progress and no remarks")
    return shared


def _parser(commands: Mapping[str, CliCommand]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="contact", description="Contact-area editing and contact-driven posing for animation."
    )
    parser.add_argument("--version", action="version", version=f"contact-core {__version__}")
    choices = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in commands.values():
        summary = command.summary.replace("%", "%%")  # argparse reads it as a format
        sub = choices.add_parser(command.name, help=summary, description=summary, parents=[_shared()])
        command.configure(sub)
        sub.set_defaults(command=command)
    return parser
