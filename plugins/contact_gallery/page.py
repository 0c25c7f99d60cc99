"""gallery.md: a grid of all figures, then each with its pictures, its table, its cost and its script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contact_gallery.figure import Figure

HEAD = """# Gallery

Every figure of the paper ("Contact Edit", TOG 2023), made again by a short script through the
public interface, on assets that come with the package, and measured. `contact gallery --all --out DIR` makes this
page; `contact gallery NAME --out DIR` makes one figure. Seconds are those of a processor for the script: reading,
painting, transferring and solving included, drawing left out; so are those in the tables. Operations are what an
artist has to do: strokes, edits, transfers, pairings, solves.
"""


def page(made: Sequence[tuple[Figure, Mapping[str, Any]]]) -> str:
    """The page of figures and what they measured."""
    parts = [HEAD, *_overview(made), *_efforts(made)]
    for figure, record in made:
        parts += _section(figure, record)
    return "\n".join(parts) + "\n"


def _overview(made: Sequence[tuple[Figure, Mapping[str, Any]]]) -> list[str]:
    lines = ['<div class="grid cards" markdown>', ""]
    for figure, record in made:
        lines += [
            f"-   [![{figure.title}](gallery/{record['pictures'][-1]})](#{figure.name})",
            "",
            f"    {figure.title}",
            "",
        ]
    lines += ["</div>", "", "| figure | of the paper | seconds | operations |", "|---|---|---|---|"]
    for figure, record in made:
        cost = record["operations"] or ""
        lines.append(f"| [{figure.title}](#{figure.name}) | {figure.paper} | {record['seconds']:.1f} | {cost} |")
    return [*lines, ""]


EFFORTS = """## Operations and seconds per pose {: #efforts }

What the paper's appendix tells of its users, without people: what each pose of the figures took, logged by the
session itself. Anyone can switch that on, by `CONTACT_OPERATIONS=FILE`: local, plain JSON, no names. Contacts that
a pose takes over from the pose before are not painted again. Seconds are a processor's, from the first
operation to the last; the looking and thinking of a person is not in them. The paper's five users took 4.6 to 17.7
minutes per pose, all of them people's time, so the two are no comparison; the count of operations is one.

| pose | strokes | transfers | edits | links and pairs | solves | operations | undos | seconds |
|---|---|---|---|---|---|---|---|---|"""
SOLVES = dict.fromkeys(("solve", "settle", "slide"), 4)
KINDS = {"paint": 0, "transfer": 1, "link": 3, "pair": 3, **SOLVES}  # columns by the tool; edits are all others


def _efforts(made: Sequence[tuple[Figure, Mapping[str, Any]]]) -> list[str]:
    """The table of what each pose took; nothing where no figure made one."""
    rows = []
    for figure, record in made:
        for effort in record.get("efforts", ()):
            counts = [0] * 5
            for tool, count in effort["tools"].items():
                counts[KINDS.get(tool, 2)] += count
            cells = [*counts, sum(counts), effort["undos"], f"{effort['seconds']:.1f}"]
            rows.append(f"| [{effort['pose']}](#{figure.name}) | {' | '.join(map(str, cells))} |")
    return [EFFORTS, *rows, ""] if rows else []


def _section(figure: Figure, record: Mapping[str, Any]) -> list[str]:
    lines = [
        f"## {figure.title} {{: #{figure.name} }}",
        "",
        f"*{figure.paper}; script `{figure.name}`.*",
        "",
        figure.text,
        "",
    ]
    for picture, captions in zip(record["pictures"], record["captions"], strict=True):
        lines += [f"![{figure.title}: {'; '.join(captions)}](gallery/{picture})", ""]
    if record["measures"]:
        lines += ["| | paper | here |", "|---|---|---|"]
        lines += [f"| {row['what']} | {row['paper']} | {row['here']} |" for row in record["measures"]]
        lines += [""]
    return [
        *lines,
        '<details markdown="1"><summary>The script</summary>',
        "",
        "```py",
        figure.source.rstrip(),
        "```",
        "",
        "</details>",
        "",
    ]
