"""The report of a batch as one HTML file: no script, nothing from a network, every text escaped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from contact_core.farm.task import Result

_WORDS = {"done": "solved", "same": "as before", "failed": "failed", "stopped": "not run"}
_STYLE = """
:root{color-scheme:light dark;--ink:#1d2129;--dim:#6a7280;--page:#f6f6f8;--card:#fff;--line:#e3e5ea;
--bad:#b3261e;--warn:#a15c00;--good:#1f7a4d}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ec;--dim:#9aa3b2;--page:#17191d;--card:#202329;--line:#32363e;
--bad:#ff8a80;--warn:#ffb74d;--good:#7ad3a3}}
*{box-sizing:border-box}body{margin:0;padding:2rem;background:var(--page);color:var(--ink);
font:15px/1.45 system-ui,sans-serif}h1{font-size:1.4rem;margin:0 0 .3rem}p{margin:.2rem 0;color:var(--dim)}
.counts{display:flex;gap:.6rem;flex-wrap:wrap;margin:1rem 0 1.4rem}.counts b{font-size:1.5rem;display:block}
.counts span{background:var(--card);border:1px solid var(--line);border-radius:.5rem;padding:.5rem 1rem;
min-width:6rem}
article{display:grid;grid-template-columns:320px 1fr;gap:1.2rem;background:var(--card);border:1px solid var(--line);
border-left:4px solid var(--good);border-radius:.5rem;padding:.9rem;margin:0 0 .7rem}
article.failed{border-left-color:var(--bad)}article.bad{border-left-color:var(--warn)}
article.stopped{border-left-color:var(--dim)}h2{font-size:1.05rem;margin:0;overflow-wrap:anywhere}
img,.none{width:320px;border-radius:.3rem;background:var(--page)}
.none{height:128px;display:grid;place-items:center;color:var(--dim);font-size:.85rem}
.state{float:right;font-size:.85rem;color:var(--dim)}
.failed .state,.why{color:var(--bad)}.bad .state,.short{color:var(--warn)}
meter{width:12rem;vertical-align:middle}ul{margin:.3rem 0;padding-left:1.1rem}a{color:inherit}
details{color:var(--dim);font-size:.9rem;margin-top:.3rem}td{padding:0 1rem 0 0}tr.over{color:var(--warn)}
pre{overflow:auto;font-size:.8rem}@media(max-width:640px){article{grid-template-columns:1fr}body{padding:1rem}}
"""


def page_of(results: Sequence[Result], facts: Mapping[str, Any]) -> str:
    """The page. results: in the order in which they are shown. facts: the content of batch.json."""
    counts = facts["counts"]
    short = counts["done"] + counts["same"] - counts["good"]
    tiles = {"jobs": len(results), "good": counts["good"], "beyond a limit": short, "failed": counts["failed"],
             "not run": counts["stopped"], "as before": counts["same"]}  # fmt: skip
    shown = {word: number for word, number in tiles.items() if number or word == "jobs"}
    head = "".join(f"<span><b>{number}</b>{escape(word)}</span>" for word, number in shown.items())
    version = f"contact-core {facts['contact_core']}"
    told = f"{facts['finished']}, {facts['seconds']:.1f} s, {facts['workers']}, {version}"
    body = "\n".join("".join(_article(result)) for result in results)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>contact batch</title>'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; style-src'
        ' \'unsafe-inline\'"><meta name="viewport" content="width=device-width">'
        f"<style>{_STYLE}</style></head><body><h1>contact batch</h1><p>{escape(told)}</p>"
        f'<div class="counts">{head}</div><main>\n{body}\n</main></body></html>\n'
    )


def _article(result: Result) -> Iterator[str]:
    """One job: picture, name, state, how near its limit it is, what is wrong, numbers, files."""
    kind = "bad" if result.state in ("done", "same") and result.failures else result.state
    yield f'<article class="{escape(kind)}">{_image(result)}<div>'
    state = _WORDS.get(result.state, result.state)
    times = f" at attempt {result.attempts}" if result.attempts > 1 else ""
    yield f'<span class="state">{escape(state)}{times}, {result.seconds:.1f} s</span><h2>{escape(result.name)}</h2>'
    if result.sentence:
        yield f'<div class="why">{escape(result.sentence)}</div>'
    if result.state in ("done", "same"):
        share = f"{100 * result.badness:.0f} % of what is allowed"
        yield f'<p><meter min="0" max="2" low="1" high="1.0001" optimum="0" value="{min(result.badness, 2.0):.4f}">'
        yield f"</meter> {share}</p>"
    yield _items(result.failures, "short")
    yield from _details(result)
    yield "</div></article>"


def _image(result: Result) -> str:
    if result.thumbnail.startswith(("data:image/jpeg;base64,", "data:image/png;base64,")):
        return f'<img alt="{escape(result.name)}" src="{escape(result.thumbnail)}">'
    return '<div class="none">no picture</div>'


def _details(result: Result) -> Iterator[str]:
    """What is folded away: numbers, notes, files, where it ran, a traceback."""
    if not (result.rows or result.notes or result.files or result.details):
        return
    yield "<details><summary>numbers, notes, files</summary><table>"
    for name, value, over in result.rows:
        yield f"<tr{' class=over' if over else ''}><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
    yield f"</table>{_items(result.notes, '')}"
    links = (f'<a href="{escape(quote(f"{result.name}/{name}"))}">{escape(name)}</a>' for name in result.files)
    yield f"<p>{', '.join(links)}</p><p>{escape(result.worker)}</p>"
    if result.details:
        yield f"<pre>{escape(result.details)}</pre>"
    yield "</details>"


def _items(texts: Sequence[str], kind: str) -> str:
    return f'<ul class="{kind}">{"".join(f"<li>{escape(text)}</li>" for text in texts)}</ul>' if texts else ""
