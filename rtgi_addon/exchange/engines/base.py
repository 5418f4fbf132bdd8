"""What an export to an engine is: ``Engine.write`` fills a folder, ``Engine.export`` puts it where the user wants it, whole or not
at all, and leaves alone what the user put or changed there."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ...effects.stylized.settings import StylizedSettings
from ...errors import BakeError, UsageError
from ...progress import Progress
from ...scene import World
from ...storage.files import disk_error
from ...storage.inventory import BYSTANDERS
from ...storage.merge import merge_into
from ...storage.paths import check_output
from ...storage.workplace import Workplace, settle, workplace
from ...storage.writing import copy_file, write_text
from ...techniques import setting
from ...words import as_lines
from ..bundle import Bundle
from .axes import Axes
from .marker import MARKER, read_markers, write_markers

__all__ = ["MARKER", "PARTS", "Engine", "ExportReport", "ExportSettings", "copy_files", "write_text"]

_LICENSE = Path(__file__).with_name("LICENSE.txt")
# What of an export is written: the sample project around the probes too, or what goes into a project of the user's.
PARTS = ("all", "files")


@dataclass(frozen=True)
class ExportSettings:
    """What a user may choose of an export."""

    model: str | None = setting(None, "Model", "Path of a .glb of the scene, which the sample scene then shows under the probes' "
                                               "light; without one it shows spheres in the volumes")
    conformance: bool = setting(True, "Conformance Kit", "Write known probes, 200 points with their irradiance and a script that "
                                                         "holds the engine to them")
    part: str = setting("all", "Part", "Everything, or only the files that go into a project of your own")
    # The world around the scene, which the sample scene shows behind the model.
    sky: World | None = None
    # What pictures are drawn in, by engines that take styles.
    style: StylizedSettings | None = None


@dataclass(frozen=True)
class ExportReport:
    """A finished export: its folder, files and size, the volumes in it, what was ``kept`` of it because somebody had changed it
    (names relative to the folder), and what the user should know."""

    engine: str
    title: str
    out: Path
    files: tuple[str, ...]
    size: int
    volumes: tuple[str, ...]
    notes: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return {"engine": self.engine, "out": str(self.out), "files": list(self.files), "bytes": self.size,
                "volumes": list(self.volumes), "kept": list(self.kept), "notes": list(self.notes)}

    def to_text(self) -> str:
        """The report as lines for a person."""
        readme = "; how to use them is in README.md" if "README.md" in self.files else ""
        return as_lines([
            f"Exported {self.out} for {self.title}",
            f"  volumes  {', '.join(self.volumes)}",
            f"  files    {len(self.files)}, {self.size / 2**20:.1f} MiB{readme}",
            *(f"  kept     {name}, which was changed since the last export" for name in self.kept),
            *(f"  note     {note}" for note in self.notes),
        ])


class Engine(ABC):
    """One engine: names, axes, and ``write``.

    ``aliases`` are other names that the command line takes. ``parts`` are the folders, if any, that go into projects alone: nothing
    in them may need a file outside of them. ``indices`` are the files through which an engine finds others that belong together:
    they are missing while those are exchanged, and after a kill then, so that no loader takes an old and a new half for one.
    ``styles`` says that it takes one (ExportSettings.style), ``scattered`` that it reads scattered probes.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    description: ClassVar[str]
    axes: ClassVar[Axes]
    aliases: ClassVar[tuple[str, ...]] = ()
    parts: ClassVar[tuple[str, ...]] = ()
    indices: ClassVar[tuple[str, ...]] = ()
    styles: ClassVar[bool] = False
    scattered: ClassVar[bool] = False

    @abstractmethod
    def write(self, bundle: Bundle, folder: Path, settings: ExportSettings, progress: Progress) -> list[str]:
        """Write everything into the empty ``folder`` through ``write_text``, ``copy_files`` and the functions of
        storage/writing.py, and return notes for the user. Raises BakeError for what the engine cannot take, OSError for a disk
        that refuses, Cancelled when asked to stop."""

    def blend(self, name: str, theirs: bytes, ours: bytes) -> bytes | None:
        """The file called ``name``, which the engine itself or a user has changed to ``theirs``, brought up to date with ``ours``;
        None where that cannot be."""
        return None

    def export(self, bundle: Bundle, folder, settings: ExportSettings | None = None,
               progress: Progress | None = None) -> ExportReport:
        """Export ``bundle`` to ``folder`` (or into a Workplace). Files of an earlier export there are replaced all together; what
        was changed since stays as it is where nothing new is due in it, and everything else is left alone.

        Raises BakeError for a folder that holds something else, a changed file that stands in the way, a disk that refuses and what
        ``write`` refuses; then, and when it is cancelled, an earlier export stays as it was.
        """
        settings, progress = settings or ExportSettings(), progress or Progress()
        names = ", ".join(grid.volume.name for grid in bundle.grids if grid.volume.scattered is not None)
        if names and not self.scattered:
            raise BakeError(f"the probes of {names} are scattered, which an export for {self.title} does not read",
                            "bake them on a lattice (--placement lattice)")
        path = folder if isinstance(folder, Workplace) else self.check_target(folder, settings.part)
        with workplace(path, f"export to {self.name}") as place:
            try:
                return self._export(place, bundle, settings, progress)
            except OSError as error:
                raise disk_error(place.path, error) from error

    def _export(self, place: Workplace, bundle: Bundle, settings: ExportSettings, progress: Progress) -> ExportReport:
        whole, new = settings.part == "all", place.new
        base = read_markers(place.path, self.name, self.parts, whole)
        notes = self.write(bundle, new, settings, progress.span(0.0, 0.95))
        if not whole:
            for item in [item for item in new.rglob("*") if item.is_file() and item.relative_to(new).parts[0] not in self.parts]:
                item.unlink()
        # Games cannot take code under the add-on's own GPL; the part that goes into a project carries its license along.
        for part in (*([new] if whole else []), *(new / name for name in self.parts)):
            copy_files(_LICENSE.parent, part, [_LICENSE.name])
        write_markers(new, self.name, self.parts, whole)
        files = tuple(sorted(name for name in (item.relative_to(new).as_posix() for item in new.rglob("*") if item.is_file())
                             if not name.endswith(MARKER)))
        progress.step(0.98, "Putting the files in place")
        merge = merge_into(place, base, self.blend, self.indices)
        progress.step(1.0, "Done")
        size = sum((place.path / name).stat().st_size for name in files)
        return ExportReport(self.name, self.title, place.path, files, size, tuple(grid.volume.name for grid in bundle.grids),
                            tuple(notes), tuple(merge.kept))

    def check_target(self, folder, part: str = "all", inputs=(), size: int = 0) -> Path:
        """The absolute path of an export of ``part``, of at least ``size`` bytes, to be written to ``folder`` while ``inputs`` are
        read.

        Raises BakeError for a path that will not do (``check_output``), and for a folder that holds something and no export to this
        engine, unless only files for a project go there; UsageError for a part that there is not.
        """
        if part not in PARTS:
            raise UsageError(f"unknown part {part!r}", f"choose one of {', '.join(PARTS)}")
        if part != "all" and not self.parts:
            raise UsageError(f"an export for {self.title} has no part that goes into projects alone", "export --part all")
        path = check_output(folder, inputs=inputs, size=size)
        settle(path)
        try:
            base = read_markers(path, self.name, self.parts, part == "all")
            found = sorted(item.name for item in path.iterdir() if item.name not in BYSTANDERS) if path.is_dir() else []
        except OSError as error:
            raise disk_error(path, error) from error
        if found and MARKER not in base and part == "all":
            raise BakeError(f"{path} holds {found[0]}, which is not part of an export for {self.title}",
                            "choose another --out, or --part files to put the probes into a project")
        return path


def copy_files(source: Path, target: Path, names) -> None:
    """Copy the files ``names`` of folder ``source`` into folder ``target``, made if it is not there. Raises OSError."""
    for name in names:
        copy_file(source / name, target / name)
