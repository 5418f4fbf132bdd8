"""`OUT.partial`: the one folder beside a result that all of ours goes through on its way there.

```
OUT.partial/rtgi-partial.json            the mark that the folder is ours
OUT.partial/rtgi-lock.json               who is at work in it
OUT.partial/checkpoint.json, *.part      what an interrupted run can be continued from
OUT.partial/new/, written.txt            what is being written, and its list, file by file
OUT.partial/old/, commit.json            what was in the place of the result, and how far the exchange is
```

Whatever happens, a kill before any step of it included, the result is the old one or the new one, whole, and the next run in that
place finishes or takes back what the last one began. Of all this nothing is removed that the lists in it do not name.
"""

import contextlib
import errno
import fnmatch
import json
import os
import stat
import time
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from ..errors import BakeError
from . import swap
from .files import TEMPORARY, disk_error, sync_file, sync_folder, sync_tree, write_beside
from .inventory import BYSTANDERS, Stranger, first_stranger
from .lock import LOCK, Lock
from .swap import COMMIT, NEW, OLD, WRITTEN
from .written import Written

SUFFIX = ".partial"
MARK, SCHEMA = "rtgi-partial.json", "rtgi-partial/1"
HEADER, PARTS = "checkpoint.json", "[0-9a-f]" * 8 + ".part"
_MOMENT = 0.02
_MOVE = "move it away, or choose another place"


def partial_of(path) -> Path:
    """The folder beside the result ``path``."""
    path = Path(path)
    return path.with_name(path.name + SUFFIX)


def replaced_of(path) -> Path:
    """Where the folder ``path`` lies while another one takes its place, and after a kill in that moment."""
    return partial_of(path) / OLD


class Workplace:
    """The folder beside the result ``path``, held by this process. Made by ``workplace``."""

    def __init__(self, path: Path, lock: Lock, made: Collection[Path] = ()):
        """``made`` are the folders on the way there that were made for it, the innermost first."""
        self.path, self.folder = path, partial_of(path)
        self._lock, self._written, self._made = lock, None, made

    @property
    def new(self) -> Path:
        """The empty folder that the result is written into (a file: under its own name), made when it is first asked for. Files
        get there through the functions of writing.py. Raises OSError."""
        if self._written is None:
            (self.folder / NEW).mkdir()
            self._written = Written(self.folder / WRITTEN, self.folder / NEW)
        return self.folder / NEW

    def put_file(self) -> None:
        """Put the file ``new``/NAME in the place of ``path``. Raises BakeError, OSError."""
        source = self.new / self.path.name
        self._ready(sync_file, source)
        if self.path.exists():
            if not self.path.is_file():
                raise BakeError(f"{self.path} is not a file", "choose another place")
            source.chmod(stat.S_IMODE(self.path.stat().st_mode))
        os.replace(source, self.path)
        sync_folder(self.path.parent)

    def put_folder(self, ours: Mapping[str, str]) -> Stranger | None:
        """Put the folder ``new`` in the place of the folder ``path``, which holds nothing but ``ours`` (name → checksum).

        Returns what somebody put there or changed at the last moment; the old folder then stays in `OUT.partial/old`. Raises
        BakeError, OSError; the old one is then in its place.
        """
        self._ready(sync_tree, self.new)
        return swap.put_folder(self.folder, self.path, ours)

    def put_files(self, replaced: Mapping[str, str | None], removed: Mapping[str, str], indices: Collection[str] = ()) -> None:
        """Put every file of ``new`` into the folder ``path``. ``replaced`` names those of them that are there already with their
        checksums, ``removed`` those of ours that are to go; ``indices``, through which readers find the others, are not there
        meanwhile. Raises BakeError for one that somebody changes meanwhile, OSError."""
        self._ready(sync_tree, self.new)
        swap.put_files(self.folder, self.path, replaced, removed, indices)

    def has_parts(self) -> bool:
        """Whether there is something that a later run could continue from."""
        return can_resume(self.path)

    def discard_parts(self) -> None:
        """Remove the checkpoint. Raises OSError."""
        for item in list(self.folder.iterdir()):
            if _is_checkpoint(item.name.removesuffix(TEMPORARY)):
                item.unlink()

    def _ready(self, sync, path: Path) -> None:
        """Everything flushed, everything of it listed, and the place still ours."""
        unlisted = first_stranger(self.new, dict.fromkeys(self._written.names), contents=False)
        if unlisted is not None:
            raise RuntimeError(f"{unlisted.name} was not written through writing.py")
        sync(path)
        if not self._lock.still_ours():
            raise BakeError(f"somebody removed {self._lock.file} while {self.path} was being written",
                            "make sure that nobody else writes there, and try again")

    def _leave(self) -> None:
        if self._written is not None:
            self._written.close()
        with contextlib.suppress(OSError, BakeError):
            swap.recover(self.folder, self.path)
            if not self.has_parts():
                self.discard_parts()
            if {item.name for item in self.folder.iterdir()} - BYSTANDERS <= {LOCK, MARK}:
                for name in (MARK, *BYSTANDERS):
                    (self.folder / name).unlink(missing_ok=True)
                # Who opens the lock from now on finds it held, or gone.
                self._lock.remove(self.folder)
        self._lock.release()
        # Network disks keep a removed file in its folder for as long as it is open.
        with contextlib.suppress(OSError):
            self.folder.rmdir()
        # Only empty ones go: those of a run that came to nothing.
        with contextlib.suppress(OSError):
            for folder in self._made:
                folder.rmdir()


@contextlib.contextmanager
def workplace(path, doing: str) -> Iterator[Workplace]:
    """Hold the place beside the result ``path`` (absolute, as ``check_output`` gives it) while ``doing`` (a word for others).

    Folders on the way there that are missing are made, and go again if nothing comes of it.
    Finishes or takes back what a run that was killed had begun there. At the end, however it comes, what was written and not put in
    place is removed, and the folder too unless it holds a checkpoint. ``path`` may be a Workplace, which then stays open.

    Raises BakeError if another process is at work there, if the folder is in the way and not ours, if it holds anything that we did
    not write, and for a disk that refuses.
    """
    if isinstance(path, Workplace):
        yield path
        return
    path = Path(path)
    try:
        made = [folder for folder in path.parents if not folder.is_dir()]
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except FileExistsError as error:
            # It is a file: for what would lie in it that is the same as further up the path.
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path.parent)) from error
        place = Workplace(path, _hold(path, doing), made)
    except OSError as error:
        raise disk_error(partial_of(path), error) from error
    try:
        try:
            _tidy(place.folder, path)
        except OSError as error:
            raise disk_error(place.folder, error) from error
        yield place
    finally:
        place._leave()


def settle(path) -> None:
    """Finish what a run that was killed had begun to put into the folder ``path``, before anybody judges what lies there. Does
    nothing where nothing was begun. Raises as ``workplace`` does."""
    if (partial_of(path) / COMMIT).is_file():
        with workplace(path, "finish an exchange"):
            pass


def _hold(path: Path, doing: str) -> Lock:
    folder = partial_of(path)
    while True:
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
        _require_ours(folder)
        try:
            return Lock(folder, path, doing)
        except FileNotFoundError:
            # Whoever was here has just left and taken the folder along.
            if not folder.parent.is_dir():
                raise


def _require_ours(folder: Path) -> None:
    """Raise BakeError unless ``folder`` bears our mark, or holds no more than what is made before the mark. Raises OSError."""
    before = None
    while True:
        try:
            if not stat.S_ISDIR(os.lstat(folder).st_mode):
                raise BakeError(f"{folder} is in the way, rtgi did not make it", _MOVE)
            names = {item.name for item in folder.iterdir()} - BYSTANDERS
        except FileNotFoundError:
            return
        if names <= {LOCK, LOCK + TEMPORARY, MARK + TEMPORARY} or _bears_mark(folder):
            return
        # Whoever is leaving takes the mark away first.
        if names == before:
            raise BakeError(f"{folder} is in the way, rtgi did not make it", _MOVE)
        before = names
        time.sleep(_MOMENT)


def _bears_mark(folder: Path) -> bool:
    try:
        mark = json.loads((folder / MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(mark, dict) and mark.get("schema") == SCHEMA


def _tidy(folder: Path, path: Path) -> None:
    """Write the mark, and put in order what a killed run left: nothing is touched if any of it is not ours."""
    if not (folder / MARK).exists():
        about = f"what rtgi writes on its way to {path.name}; without a checkpoint it goes with the next run there"
        write_beside(folder / MARK, (json.dumps({"schema": SCHEMA, "for": path.name, "about": about}, indent=1) + "\n").encode())
    stranger = _stranger(folder) or swap.recover(folder, path)
    if stranger is not None:
        remedy = "move that away: the folder goes when the work is done"
        if stranger.changed:
            raise BakeError(f"{folder} holds {stranger.name}, which was changed since it was written", remedy)
        raise BakeError(f"{folder} holds {stranger.name}, which rtgi did not write", remedy)
    for item in list(folder.iterdir()):
        if item.name.endswith(TEMPORARY):
            item.unlink()


def _stranger(folder: Path) -> Stranger | None:
    for item in sorted(folder.iterdir()):
        name, kind = item.name.removesuffix(TEMPORARY), os.lstat(item).st_mode
        known = name in (LOCK, MARK, WRITTEN, COMMIT) or name in BYSTANDERS or _is_checkpoint(name)
        if not (name in (NEW, OLD) if stat.S_ISDIR(kind) else known and stat.S_ISREG(kind)):
            return Stranger(item.name)
    return None


def _is_checkpoint(name: str) -> bool:
    return name == HEADER or fnmatch.fnmatchcase(name, PARTS)


def can_resume(path) -> bool:
    """Whether beside the result ``path`` there is something that a later run could continue from."""
    return next(partial_of(path).glob(PARTS), None) is not None
