"""What an export to an engine is: ``Engine.write`` fills a folder, ``Engine.export`` puts it where the user wants it, whole or not
at all."""

import fnmatch
import json
import shutil
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ...errors import BakeError
from ...progress import Progress
from ...techniques import setting
from ..bundle import Bundle
from ..files import disk_error, recover_swap, remove_folder, sibling, swap_folder, sync_file, sync_folder, write_atomically
from ..schema import RTGI_VERSION
from .axes import Axes

# Names every file of an export, so that the next one knows what it may replace.
MARKER = "rtgi_export.json"
SCHEMA = "rtgi-export/1"

_LICENSE = Path(__file__).with_name("LICENSE.txt")
_BYSTANDERS = (".DS_Store", "Thumbs.db", "desktop.ini")


@dataclass(frozen=True)
class ExportSettings:
    """What a user may choose of an export."""

    model: str | None = setting(None, "Model", "Path of a .glb of the scene, which the sample scene then shows under the probes' "
                                               "light; without one it shows spheres in the volumes")
    conformance: bool = setting(True, "Conformance Kit", "Write known probes, 200 points with their irradiance and a script that "
                                                         "holds the engine to them")


@dataclass(frozen=True)
class ExportReport:
    """A finished export: its folder, files and size, the volumes in it, and what the user should know of it."""

    engine: str
    title: str
    out: Path
    files: tuple[str, ...]
    size: int
    volumes: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return {"engine": self.engine, "out": str(self.out), "files": list(self.files), "bytes": self.size,
                "volumes": list(self.volumes), "notes": list(self.notes)}

    def to_text(self) -> str:
        """The report as lines for a person."""
        return "\n".join([
            f"Exported {self.out} for {self.title}",
            f"  volumes  {', '.join(self.volumes)}",
            f"  files    {len(self.files)}, {self.size / 2**20:.1f} MiB; how to use them is in README.md",
            *(f"  note     {note}" for note in self.notes),
        ])


class Engine(ABC):
    """One engine: names, axes, and ``write``.

    ``aliases`` are other names that the command line takes. ``leftovers`` are patterns, relative to an export, of what the engine
    itself writes beside its files (caches, import records): replacing an export removes them with it. ``parts`` are the folders
    that users copy out of an export.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    description: ClassVar[str]
    axes: ClassVar[Axes]
    aliases: ClassVar[tuple[str, ...]] = ()
    leftovers: ClassVar[tuple[str, ...]] = ()
    parts: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """Write everything into the empty ``folder`` and return notes for the user. Raises BakeError for what the engine cannot
        take, OSError for a disk that refuses, Cancelled when asked to stop."""

    def export(self, bundle: Bundle, folder, settings: ExportSettings | None = None,
               progress: Progress | None = None) -> ExportReport:
        """Export ``bundle`` to ``folder``, which takes the place of an earlier export in one step.

        Raises BakeError for a folder that holds anything else, a disk that refuses and what ``write`` refuses; then, and when it
        is cancelled, an earlier export stays as it was.
        """
        settings, progress = settings or ExportSettings(), progress or Progress()
        path = self.check_target(folder)
        new = sibling(path, "rtgi-new")
        try:
            remove_folder(new)
            new.mkdir()
            notes = self.write(bundle, new, settings, progress.span(0.0, 0.95))
            # Games cannot take code under the add-on's own GPL; the part that goes into a project carries its license along.
            for place in (new, *(new / name for name in self.parts)):
                shutil.copyfile(_LICENSE, place / _LICENSE.name)
            files = tuple(sorted(item.relative_to(new).as_posix() for item in new.rglob("*") if item.is_file()))
            marker = {"schema": SCHEMA, "engine": self.name, "rtgi": RTGI_VERSION, "files": list(files)}
            write_atomically(new / MARKER, (json.dumps(marker, indent=1) + "\n").encode())
            _flush(new)
            size = sum((new / name).stat().st_size for name in files)
            progress.step(0.98, "Replacing the folder")
            swap_folder(new, path)
        except OSError as error:
            raise disk_error(path, error) from error
        finally:
            shutil.rmtree(new, ignore_errors=True)
        progress.step(1.0, "Done")
        return ExportReport(self.name, self.title, path, files, size, tuple(grid.volume.name for grid in bundle.grids),
                            tuple(notes))

    def check_target(self, folder) -> Path:
        """The absolute path of an export to be written to ``folder``, after a swap that was interrupted is mended.

        Raises BakeError if the parent folder is missing, or if ``folder`` holds anything but an export to this engine.
        """
        path = Path(folder).expanduser().resolve()
        if not path.parent.is_dir():
            raise BakeError(f"the folder {path.parent} does not exist", "create it first, or choose another --out")
        try:
            recover_swap(path)
            if path.exists() and not path.is_dir():
                raise BakeError(f"{path} is a file", "choose a folder as --out")
            stranger = self._stranger(path) if path.is_dir() else None
        except OSError as error:
            raise disk_error(path, error) from error
        if stranger is not None:
            raise BakeError(f"{path} holds {stranger}, which is not part of an export for {self.title}",
                            "choose another --out, or move that away: the whole folder is replaced")
        return path

    def _stranger(self, folder: Path) -> str | None:
        """The first thing in ``folder`` that neither an export to this engine nor the engine put there, or None."""
        try:
            marker = json.loads((folder / MARKER).read_text(encoding="utf-8"))
            ours = set(marker["files"]) if marker["engine"] == self.name else set()
        except (FileNotFoundError, ValueError, KeyError, TypeError):
            ours, marker = set(), None
        if not ours:
            return next((item.name for item in sorted(folder.iterdir()) if item.name not in _BYSTANDERS), None)
        known = {MARKER, *ours}
        for item in sorted(folder.rglob("*")):
            name = item.relative_to(folder).as_posix()
            if not item.is_dir() and name not in known and item.name not in _BYSTANDERS and not self._is_leftover(name):
                return name
        return None

    def _is_leftover(self, name: str) -> bool:
        return any(fnmatch.fnmatchcase(name, pattern) for pattern in self.leftovers)


def copy_files(source: Path, target: Path, names) -> None:
    """Copy the files ``names`` of folder ``source`` into folder ``target``, made if it is not there. Raises OSError."""
    target.mkdir(parents=True, exist_ok=True)
    for name in names:
        shutil.copyfile(source / name, target / name)


def write_text(path: Path, text: str) -> None:
    """Write ``text`` as UTF-8 with Unix line ends on every system, folders made as needed. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def _flush(folder: Path) -> None:
    for item in folder.rglob("*"):
        if item.is_file():
            sync_file(item)
        elif item.is_dir():
            sync_folder(item)
    sync_folder(folder)
