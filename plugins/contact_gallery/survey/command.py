"""`contact survey make FIRST SECOND --out DIR`, and `contact survey tally DIR/key.json ANSWERS...`."""

from __future__ import annotations

import argparse
from pathlib import Path

from contact_core.cli.output import columns


class SurveyCommand:
    name = "survey"
    summary = "compare two sets of pictures blindly: sheets to hand out, a key to keep, and the tally"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        acts = parser.add_subparsers(title="acts", metavar="ACT", required=True)
        again = argparse.ArgumentParser(add_help=False, argument_default=argparse.SUPPRESS)
        for flag in ("--json", "--quiet"):  # said before the act or after it
            again.add_argument(flag, action="store_true", help=argparse.SUPPRESS)
        make = acts.add_parser("make", parents=[again], help="make the sheets of a survey, and its key")
        make.add_argument(
            "folders", nargs=2, type=Path, metavar="DIR", help="two folders of pictures of the same names"
        )
        make.add_argument("--names", nargs=2, metavar="NAME", help="of the two in the tally (those of the folders)")
        make.add_argument("--seed", type=int, help="of the lots (another each time)")
        make.add_argument("--out", type=Path, required=True, metavar="DIR", help="the folder for sheets and key")
        count = acts.add_parser("tally", parents=[again], help="count answers against the key")
        count.add_argument("key", type=Path, metavar="key.json")
        count.add_argument("answers", nargs="+", type=Path, metavar="ANSWERS", help="files, .json or .csv")
        for name, act in acts.choices.items():
            act.set_defaults(act=name)

    def run(self, arguments: argparse.Namespace) -> int:
        return _make(arguments) if arguments.act == "make" else _tally(arguments)


def _make(arguments: argparse.Namespace) -> int:
    import secrets

    from contact_gallery.survey.sheets import make_survey

    seed = secrets.randbits(63) if arguments.seed is None else arguments.seed
    key, alone = make_survey(
        (arguments.folders[0], arguments.folders[1]),
        arguments.out,
        seed=seed,
        names=tuple(arguments.names) if arguments.names else None,
    )
    said = [f"{len(key.pairs)} pairs; hand out {arguments.out / 'sheets'}, keep {arguments.out / 'key.json'}"]
    said += [f"without a partner: {', '.join(alone)}"] if alone else []
    arguments.output.answer({"survey": key.survey, "pairs": len(key.pairs), "alone": alone}, "\n".join(said))
    return 0


def _tally(arguments: argparse.Namespace) -> int:
    from contact_gallery.survey.pairs import read_key
    from contact_gallery.survey.tally import read_answers, tally

    key = read_key(arguments.key)
    answers = read_answers(arguments.answers, key)
    rows, people = tally(key, answers), len({answer.person for answer in answers})
    lines = [["", "votes", "neither", "p", "score", "p of pairs"]]
    for row in rows:
        first, second, neither = row["votes"]
        score = " : ".join(f"{one:g}" for one in row["score"])
        by_votes, by_pairs = (f"{row[p]:.3g}" for p in ("p_votes", "p_pairs"))
        lines.append([row["question"], f"{first} : {second}", f"{neither}", by_votes, score, by_pairs])
    said = f"{people} people, {len(key.pairs)} pairs, {key.sets[0]} : {key.sets[1]}\n{columns(lines)}"
    arguments.output.answer({"sets": key.sets, "people": people, "questions": rows}, said)
    return 0
