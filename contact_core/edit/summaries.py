"""What happened, in the artist's terms: the bodies of `contact history`, `contact replay` and `contact diff`.

Plain functions that answer lines of text or raise ContactError; the command line prints them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from contact_core.contact.placement import Link, Placement, Walk
from contact_core.document.codec import to_json
from contact_core.document.document import ContactDocument, Patch
from contact_core.document.schema import dump_document
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable
from contact_core.edit.history import History
from contact_core.edit.journal_file import read_journal
from contact_core.edit.recovery import journal_path, read_document, write_document
from contact_core.edit.replay import replay
from contact_core.errors import FileRefused


def history_lines(path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> list[str]:
    """The steps that the journal of a document (or a journal itself) records, oldest first.

    A mark shows where the history stands (>) and what is undone (-). Raises FileRefused when there is no journal.
    """
    journal = _journal_of(path)
    contents = read_journal(journal)
    replayed = replay(contents, commands)
    history = replayed.history
    lines = [f"{journal.name}: {_count(len(history.steps), 'step')} from revision {history.base_revision}"]
    done = len(history.done)
    for number, step in enumerate(history.steps, start=1):
        mark = ">" if number == done else " " if number < done else "-"
        origin = "" if step.origin == "user" else f"  ({step.origin})"
        lines.append(f"{mark} {step.revision:5d}  {_printable(step.command.label() + origin)}")
    lines += [f"! {sentence}" for sentence in (contents.damage, *replayed.trouble) if sentence]
    lines.append("closed in order" if contents.closed else "not closed: the session runs, or was interrupted")
    return lines


def replay_lines(path: Path, output: Path | None = None, commands: CommandTable = BUILT_IN_COMMANDS) -> list[str]:
    """Replay a journal (or that of a document) and say what came of it; write the document to `output` if given."""
    contents = read_journal(_journal_of(path))
    replayed = replay(contents, commands)
    history = replayed.history
    lines = [f"replayed {_count(contents.edits, 'event')} to revision {history.revision}: {_summary(history)}"]
    lines += [f"! {sentence}" for sentence in (contents.damage, *replayed.trouble) if sentence]
    if output is not None:
        if output.exists():
            raise FileRefused(f"{output} exists already; a replay overwrites nothing.")
        write_document(output, history.document)
        lines.append(f"wrote {output}")
    return lines


def diff_lines(before: Path, after: Path) -> list[str]:
    """What changed from one document file to another. No line when nothing did. Raises FileRefused."""
    return list(changes(read_document(before)[0], read_document(after)[0]))


def changes(before: ContactDocument, after: ContactDocument) -> Iterator[str]:
    """Sentences on what changed from one document to another; none when they say the same."""
    yield from _named_changes("surface", before.surfaces, after.surfaces)
    for name in sorted(set(before.patches) | set(after.patches)):
        old, new = before.patches.get(name), after.patches.get(name)
        if old is None and new is not None:
            yield f"patch {name}: painted on {new.surface}, {_count(len(after.shapes[new.shape]), 'point')}"
        elif new is None:
            yield f"patch {name}: removed"
        elif old is not None:
            yield from (f"patch {name}: {what}" for what in _patch_changes(before, after, old, new))
    yield from _named_changes("pair", before.pairs, after.pairs)
    yield from _named_changes("group", before.groups, after.groups)
    yield from _named_changes("pose of", before.poses, after.poses)
    yield from _named_changes("data of", before.extras, after.extras)
    yield from _time_changes(before, after)


def _time_changes(before: ContactDocument, after: ContactDocument) -> Iterator[str]:
    if before.timeline != after.timeline:
        first, last = after.timeline.first, after.timeline.last
        yield f"timeline: frames {first:g} to {last:g} at {after.timeline.frames_per_second:g} per second"
    yield from _named_changes("keys of", before.tracks, after.tracks)
    yield from _named_changes("spans of", before.spans, after.spans)


def _patch_changes(before: ContactDocument, after: ContactDocument, old: Patch, new: Patch) -> Iterator[str]:
    if old.surface != new.surface:
        yield f"now on {new.surface}, was on {old.surface}"
    yield from _placement_changes(old.placement, new.placement)
    was, now = before.shapes[old.shape], after.shapes[new.shape]
    if len(was) != len(now):
        yield f"{_count(len(now), 'point')}, was {len(was)}"
    elif was.coordinates.digest != now.coordinates.digest:
        yield "painted anew"
    elif was.axis.lengths.tolist() != now.axis.lengths.tolist():
        yield f"another axis, of {_count(now.axis.point_count, 'point')}"
    axis, new_axis = before.effective_axis(old.name), after.effective_axis(new.name)
    if axis.turning_angles.shape == new_axis.turning_angles.shape:
        bent = [
            k for k, (a, b) in enumerate(zip(axis.turning_angles, new_axis.turning_angles, strict=True)) if a != b
        ]
        for k in bent[:3]:
            turn = math.degrees(new_axis.turning_angles[k] - axis.turning_angles[k])
            yield f"bent by {turn:+.1f} degrees at axis point {k + 1}"
        if len(bent) > 3:
            yield f"bent at {len(bent) - 3} more axis points"
    if (axis.along, axis.spread) != (new_axis.along, new_axis.spread):
        yield f"scaled to {new_axis.along:.3g} along and {new_axis.spread:.3g} across its axis"
    if old.mirrored != new.mirrored:
        yield "mirrored" if new.mirrored else "no longer mirrored"
    if old.shape != new.shape:
        yield "has a shape of its own now"
    if was.weights.tolist() != now.weights.tolist() and len(was) == len(now):
        yield "other point weights"
    if old.color != new.color:
        yield "recoloured"


def _placement_changes(old: Placement, new: Placement) -> Iterator[str]:
    if isinstance(old, Link) and isinstance(new, Link):
        if old.parent != new.parent:
            yield f"is a child of {new.parent} now, was of {old.parent}"
        elif old != new:
            yield f"moved relative to {new.parent}"
    elif isinstance(new, Link):
        yield f"is a child of {new.parent} now"
    elif isinstance(old, Link):
        yield f"unlinked from {old.parent}"
    elif isinstance(old, Walk) or isinstance(new, Walk):
        if old != new:
            yield "moved along the surface"
    elif (old.face, old.barycentric) != (new.face, new.barycentric):
        yield f"moved to face {new.face}" if new.face != old.face else f"moved within face {new.face}"
    elif old.heading != new.heading:
        turn = new.heading / old.heading
        yield f"rotated by {math.degrees(math.atan2(turn.imag, turn.real)):+.1f} degrees"


def _named_changes(kind: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    for name in sorted(set(before) | set(after)):
        if name not in before:
            yield f"{kind} {name}: added"
        elif name not in after:
            yield f"{kind} {name}: removed"
        elif before[name] is not after[name] and (was := to_json(before[name])) != (now := to_json(after[name])):
            fields = [key for key in now if was.get(key) != now[key]] if isinstance(now, dict) else []
            yield f"{kind} {name}: changed" + (f" ({', '.join(fields)})" if fields else "")


def _journal_of(path: Path) -> Path:
    """The journal that a path means: itself, the one beside it, or the one of the session before."""
    beside = journal_path(path)
    for candidate in (beside, beside.with_name(beside.name + ".previous")):
        if candidate.exists():
            return candidate
    if ".journal" in path.name and path.exists():
        return path
    raise FileRefused(f"there is no journal of {path} (looked for {beside.name} beside it).")


def _summary(history: History) -> str:
    document = history.document
    parts = [_count(len(document.patches), "patch"), _count(len(document.pairs), "pair")]
    return f"{', '.join(parts)}, {len(dump_document(document))} bytes"


def _printable(text: str) -> str:
    """Titles are free text, and terminals obey what they are sent: what cannot be printed becomes a "?"."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _count(number: int, noun: str) -> str:
    plural = noun + ("es" if noun.endswith("ch") else "s")
    return f"{number} {noun if number == 1 else plural}"
