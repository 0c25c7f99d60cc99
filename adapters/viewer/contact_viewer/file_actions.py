"""What an application does with files: bring in, save, export."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path

from contact_core.opening import DOCUMENT_SUFFIX
from contact_core.scene.memory_scene import save_scene
from contact_core.session import Session
from contact_viewer import files
from contact_viewer.host import ViewerHost
from contact_viewer.recovery import Recovery


class FileActions:
    """The part of an application that reads and writes."""

    _recovery: Recovery
    _path: Path | None = None

    @property
    @abstractmethod
    def session(self) -> Session:
        """What is edited now."""

    @abstractmethod
    def open(self, sources: Sequence[str]) -> None:
        """Go on with other files."""

    @abstractmethod
    def say(self, sentence: str) -> None:
        """Let a sentence stand in the line of status."""

    @abstractmethod
    def add(self, sources: Sequence[str | Path]) -> None:
        """Bring further meshes and rigs into the scene."""

    def bring(self, sources: Sequence[str]) -> None:
        """Open what was dropped or named: a scene in place of this one, meshes and rigs beside what is there.
        Raises FileRefused."""
        scenes = files.scenes_of(sources, self.session.plugins)
        if scenes:
            self.open(list(sources))
        else:
            self.add(sources)

    @property
    def title(self) -> str:
        """What is open, for the title of a window."""
        path = getattr(self.session.host, "path", None) or self._path
        name = path.name if path is not None else "untitled"
        return f"{name}{'' if self.session.history.is_clean else ' •'}"

    def save(self, path: Path | str | None = None) -> None:
        """Save where it came from, or at a path. Raises FileRefused."""
        target = None if path is None else Path(path)
        if target is None and isinstance(self.session.host, ViewerHost) and self.session.host.path is None:
            target = files.free_path(self._path)
        saved = files.save(self.session, target)
        self._path = saved
        self._recovery.forget()
        self.say(f"saved {saved}.")

    def write(self, path: Path) -> None:
        """Save under another name, or export, as the suffix says. Raises FileRefused."""
        if path.suffix.lower() in (files.SCENE_SUFFIX, DOCUMENT_SUFFIX):
            self.save(path)
        else:
            self.export(path)

    def write_copy(self, path: Path) -> None:
        """Write the scene or an export somewhere, and go on as before. Raises FileRefused."""
        host = self.session.host
        if path.suffix.lower() == files.SCENE_SUFFIX and isinstance(host, ViewerHost):
            save_scene(host.scene, path)
        else:
            files.export(self.session, path)

    def export(self, path: Path | str) -> None:
        """Write the posed scene. Raises FileRefused."""
        files.export(self.session, Path(path))
        self.say(f"wrote {path}.")
