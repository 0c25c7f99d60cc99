"""Tutorials, questions and the site: each step has its picture, each failure sentence is real, no link is dead."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest

import contact_builtins
import contact_core as contact
from contact_core.contact.brush import BrushGesture
from contact_core.errors import ContactError
from contact_core.testing import meshes

FILE = re.compile(r'^```python title="(\w+\.py)"\n(.*?)^```', re.MULTILINE | re.DOTALL)


def page(repository: Path, name: str) -> str:
    return (repository / "docs" / name).read_text(encoding="utf-8")


def test_every_step_of_the_tutorial_has_code_and_its_picture(repository: Path) -> None:
    steps = page(repository, "tutorial.md").split("\n## ")[1:-1]
    assert [step.split(".")[0] for step in steps] == [str(number + 1) for number in range(len(steps))]
    for number, step in enumerate(steps, start=1):
        assert "```python" in step and f"(tutorial/{number}.jpg)" in step
        size = (repository / "docs" / "tutorial" / f"{number}.jpg").stat().st_size
        assert 1000 < size < 200_000


def test_the_tutorial_is_read_in_nine_minutes(repository: Path) -> None:
    """At 200 words a minute, code included as words, with a minute left for each two steps' doing."""
    words = len(re.findall(r"\w[\w.'-]*", page(repository, "tutorial.md")))
    assert words / 200 + 4 <= 9


def test_the_studio_s_files_are_a_plugin_that_keeps_its_contract(repository: Path, tmp_path: Path) -> None:
    for name, code in FILE.findall(page(repository, "tutorial-studio.md")):
        (tmp_path / name).write_text(code, encoding="utf-8")
    folders = os.pathsep.join([str(tmp_path), *(path for path in sys.path if path)])
    environment = {**os.environ, "PYTHONPATH": folders, "CONTACT_PLUGINS": "studio_house"}
    run = subprocess.run(
        [sys.executable, "-m", "contact_core", "plugins", "--check"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-2000:]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0 and "passed" in run.stdout, run.stdout[-2000:] + run.stderr[-2000:]


def refused(act: Callable[[], object]) -> str:
    """What the program says to something that it refuses."""
    with pytest.raises(ContactError) as caught:
        act()
    return str(caught.value)


def test_every_sentence_of_the_questions_is_really_said(repository: Path, tmp_path: Path) -> None:
    with contact.new(
        ball=meshes.icosphere(3), sheet=meshes.plane(12), plugins=[contact_builtins], discover=False
    ) as session:
        ball = session.geometry.mesh("ball")
        top = contact.SurfacePoints.at_vertices(ball, [0])
        session.patches.brush("disk", "pad", surface="ball", at=top, radius=0.3, spacing=0.1)
        copy = session.patches.transfer("pad", "sheet", contact.SurfacePoints.at_vertices(
            session.geometry.mesh("sheet"), [84]), direction=(1, 0, 0))  # fmt: skip
        stale = session.revision
        away = BrushGesture(
            ball, contact.SurfacePoints([], []), radius=0.1, screen=[(0.0, 0.0), (1.0, 1.0)],
            rays=lambda at: (at[:, [0, 1, 1]] + 50.0, at[:, [0, 0, 1]] + 1.0),
        )  # fmt: skip
        said = [
            refused(lambda: session.patches.brush("curve", "line", away, surface="ball")),
            refused(lambda: session.patches.brush("disk", "other", at=top, radius=0.1)),
            refused(lambda: session.patches.paint("pad", session.geometry.points("pad"))),
            refused(lambda: session.patches.transfer("pad", "sheet", top)),
            refused(lambda: session.patches.link("pad", copy)),
            refused(session.solve),
            refused(lambda: session.accept(_proposal_for(stale - 1))),
            refused(session.save),
            refused(lambda: session.patches.rotate("thumb", 0.1)),
            refused(lambda: contact.open(tmp_path / "scene.xyz")),
        ]
    quoted = re.findall(r"^> \*\*(.+)\*\*$", page(repository, "faq.md"), re.MULTILINE)
    assert len(quoted) == len(said)
    for sentence in quoted:
        assert any(sentence.rstrip(".") in one for one in said), (sentence, said)


def _proposal_for(revision: int) -> contact.Proposal:
    """A proposal for a document as it was; only its revision is looked at before it is refused."""
    proposal = object.__new__(contact.Proposal)
    object.__setattr__(proposal, "revision", revision)
    return proposal


class Links(HTMLParser):
    """What a page links and loads, and the places in it that can be linked."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = set()
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.places.update(value for key in ("id", "name") if (value := given.get(key)))
        if tag == "a" and given.get("href"):
            self.links.append(str(given["href"]))
        source = given.get("src") or (
            given.get("href") if tag == "link" and given.get("rel") == "stylesheet" else None
        )
        if source:
            self.loaded.append(source)


def test_the_site_has_no_dead_link_and_loads_nothing_from_the_net(repository: Path, tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    site = tmp_path / "site"
    run = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(site)],
        cwd=repository, capture_output=True, text=True, check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr[-2000:]
    pages = {
        path: Links(path.read_text(encoding="utf-8")) for path in site.rglob("*.html") if path.name != "404.html"
    }
    assert len(pages) > 30
    dead = []
    for path, found in pages.items():
        for target in [*found.links, *found.loaded]:
            where, place = urldefrag(target)
            if re.match(r"[a-z]+:", where):
                if target in found.loaded:
                    dead.append((path.name, f"loads {target} from the net"))
                continue
            there = (path.parent / unquote(where)).resolve() if where else path
            there = there / "index.html" if there.is_dir() else there
            if not there.exists() or (place and there in pages and unquote(place) not in pages[there].places):
                dead.append((str(path.relative_to(site)), target))
    assert not dead, dead[:20]
