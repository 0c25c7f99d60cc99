"""The command line `contact`: a frame of sub-commands, some of them brought by plugins.

`--help` must answer at once, so this package and the modules that plugins register import nothing heavy at their
top; each command imports what it needs inside `run`. `run` finds the session's plugins in `arguments.plugins`
(PluginManager) and the way to answer in `arguments.output` (Output).
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

from contact_core._version import __version__
from contact_core.cli.output import Output
from contact_core.errors import ContactError
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import CLI, resolve
from contact_core.plugins.slots import CliCommand

_OWN = (
    "contact_core.cli.pose:Pose",
    "contact_core.cli.samples:Samples",
    "contact_core.cli.edits:History",
    "contact_core.cli.edits:Replay",
    "contact_core.cli.edits:Diff",
    "contact_core.cli.plugins:Plugins",
    "contact_core.cli.new_plugin:NewPlugin",
    "contact_core.cli.warm_up:WarmUp",
)


def main(argv: Sequence[str] | None = None, *, plugins: PluginManager | None = None) -> int:
    """Run `contact` with arguments (default: those of the process); returns the exit code.

    0: done. 1: done, and the answer is no (a check that failed). 2: a ContactError, told in one sentence on stderr.
    130: interrupted.
    """
    plugins = plugins or PluginManager()
    arguments = _parser(_commands(plugins)).parse_args(argv)
    arguments.plugins = plugins
    with Output(json=arguments.json, quiet=arguments.quiet).closing() as output:
        arguments.output = output
        try:
            return int(arguments.command.run(arguments))
        except ContactError as error:
            output.error(str(error))
        except OSError as error:
            output.error(f"{error.filename or 'the system'}: {error.strerror or error}.")
        except KeyboardInterrupt:
            output.error("interrupted.")
            return 130
    return 2


def _commands(plugins: PluginManager) -> Mapping[str, CliCommand]:
    """Sub-commands by name; a plugin cannot take the name of one of ours."""
    own: dict[str, CliCommand] = {command.name: command for command in (resolve(place)() for place in _OWN)}
    return {**plugins.offers(CLI), **own}


def _parser(commands: Mapping[str, CliCommand]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="contact", description="Contact-area editing and contact-driven posing for animation."
    )
    parser.add_argument("--version", action="version", version=f"contact-core {__version__}")
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("--json", action="store_true", help="answer with one JSON document")
    shared.add_argument("--quiet", action="store_true", help="no progress and no remarks")
    choices = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in commands.values():
        sub = choices.add_parser(command.name, help=command.summary, description=command.summary, parents=[shared])
        command.configure(sub)
        sub.set_defaults(command=command)
    return parser
