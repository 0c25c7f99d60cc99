"""gallery.md: a grid of all figures, then each with its pictures, its table, its cost and its script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contact_gallery.exhibition import Figure

HEAD = """# Gallery

Every figure of the paper ("Contact Edit", TOG 2023), made again by a short script through the
public interface, on assets that come with the package, and measured. `contact gallery --all --out DIR` makes this
page; `contact gallery NAME --out DIR` makes one figure. Seconds are those of the script on one core, reading,
painting, transferring and solving included, drawing left out. Operations are what an artist has to do: strokes,
edits, transfers, pairings, solves.
"""


def page(made: Sequence[tuple[Figure, Mapping[str, Any]]]) -> str:
    """The page of figures and what they measured."""
    parts = [HEAD, *_overview(made)]
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
