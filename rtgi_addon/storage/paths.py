"""The one check of every path that a user gives to be written, before any work is done for it."""

import contextlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from ..errors import BakeError, UsageError
from .files import disk_error
from .lock import require_free
from .parse import quoted
from .workplace import MARK, SUFFIX, partial_of

# By a file that bears witness, what a folder is that nothing else may be put into.
BUNDLE_MARK = "bake.json"
_CLOSED = {BUNDLE_MARK: b'"rtgi-bundle/', MARK: b'"rtgi-partial/'}


def check_output(path, *, folder: bool = True, option: str = "--out", suffixes: Iterable[str] = (), replaced: bool = False,
                 inputs: Iterable = (), others: Iterable = (), size: int = 0) -> Path:
    """The absolute path, links followed, of a result that ``option`` sends to ``path``: a file, or a ``folder``.

    ``suffixes`` are those that a file may have; ``replaced`` says that the folder is replaced as a whole, so that nothing else may
    lie in it; ``inputs`` are the files and folders that are read meanwhile; ``others`` the other results of the same run;
    ``size`` the bytes that it takes at least, where that is known.

    Makes nothing; missing folders on the way are made when the work begins. Raises UsageError for a wrong suffix, BakeError where
    the path will not do: it is a file where a folder is due or the other way round, leads through a file, is an input, in or
    around one, inside a bundle or unfinished work, cannot be written or replaced, or has too little room; also if another process
    is writing it.
    """
    require_suffix(path, tuple(suffixes), option)
    target = resolved(path, option)
    try:
        _require_place(target, folder, option)
        for other in inputs:
            _require_apart(target, resolved(other, option), folder and replaced, option)
        for other in others:
            _require_other(target, resolved(other, option), option)
        _require_open(target, replaced, option)
        _require_writable(target, folder, replaced, option)
        require_free(partial_of(target), target)
    except OSError as error:
        raise disk_error(target, error) from error
    if size:
        require_room(target, size)
    return target


def require_suffix(path, suffixes: tuple[str, ...], option: str) -> None:
    """Raise UsageError unless ``path`` ends in one of ``suffixes``, if there are any."""
    if suffixes and Path(path).suffix.lower() not in suffixes:
        raise UsageError(f"{path} does not end in {' or '.join(suffixes)}", f"give {option} one of these ends")


def resolved(path, option: str = "the path") -> Path:
    """``path`` (``option`` says what it was given as) absolute, links followed. Raises BakeError for what names nothing: an empty
    text, a null byte, a home that nobody has, links in a circle."""
    if not str(path).strip():
        raise BakeError("the name is empty", f"correct {option}")
    try:
        target = Path(path).expanduser().resolve()
        os.fsencode(target)
    except (OSError, RuntimeError, ValueError) as error:
        raise BakeError(f"{quoted(str(path))} is no path, {str(error).lower()}", f"correct {option}") from None
    return target


def _require_place(target: Path, folder: bool, option: str) -> None:
    if not target.name:
        raise BakeError(f"{target} is the top of a disk", f"give {option} a folder in it")
    place = _nearest(target.parent)
    if not place.is_dir():
        raise BakeError(f"{place} is no folder, and {target} cannot be made in it", f"choose another {option}")
    if not os.path.lexists(target):
        return
    kind = os.stat(target).st_mode
    if folder and not stat.S_ISDIR(kind):
        raise BakeError(f"{target} is a file", f"choose a folder as {option}")
    if not folder and stat.S_ISDIR(kind):
        raise BakeError(f"{target} is a folder", f"choose a file as {option}")
    if not folder and not stat.S_ISREG(kind):
        raise BakeError(f"{target} is a device or a pipe", f"choose a file as {option}")
    if not folder and not os.access(target, os.W_OK):
        raise BakeError(f"{target} is write-protected", f"choose another {option}, or change its permissions")


def _nearest(folder: Path) -> Path:
    """``folder``, or what of its path is there already: the rest is made when the work begins (``workplace``)."""
    return next(place for place in (folder, *folder.parents) if os.path.lexists(place))


def _require_apart(target: Path, source: Path, around: bool, option: str) -> None:
    """``around`` also refuses a target that the source lies in."""
    same = target == source or (target.exists() and source.exists() and os.path.samefile(target, source))
    if same or (around and source.is_relative_to(target)) or (target.is_relative_to(source) and source.is_dir()):
        remedy = f"choose another {option}"
        if same:
            raise BakeError(f"{target} is what is read", remedy)
        if source.is_relative_to(target):
            raise BakeError(f"{source}, which is read, lies in {target}", remedy)
        raise BakeError(f"{target} lies inside {source}, which is read", remedy)


def _require_other(target: Path, other: Path, option: str) -> None:
    """Apart from the other result, and from what lies beside it while it is written."""
    for one in (target, target.with_name(target.name + SUFFIX)):
        for two in (other, other.with_name(other.name + SUFFIX)):
            if one.is_relative_to(two) or two.is_relative_to(one):
                raise BakeError(f"{target} and {other} are both to be written and lie in each other's way",
                                f"choose another {option}")


def _require_open(target: Path, replaced: bool, option: str) -> None:
    """Not inside a bundle or unfinished work; a folder that is not replaced is none itself."""
    for folder in (target, *target.parents):
        for name, word in _CLOSED.items():
            if (folder == target and replaced and name == BUNDLE_MARK) or not _bears(folder / name, word):
                continue
            remedy = f"choose another {option}"
            if folder == target:
                raise BakeError(f"{target} is a bundle or unfinished work", remedy)
            raise BakeError(f"{target} lies inside {folder}, which is a bundle or unfinished work", remedy)


def _bears(file: Path, word: bytes) -> bool:
    try:
        if not stat.S_ISREG(os.stat(file).st_mode):
            return False
        with open(file, "rb") as stream:
            return word in stream.read(4096)
    except OSError:
        return False


def _require_writable(target: Path, folder: bool, replaced: bool, option: str) -> None:
    parent = _nearest(target.parent)
    longest = os.pathconf(parent, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
    for name in (target.name + SUFFIX, *target.parent.relative_to(parent).parts):
        if len(os.fsencode(name)) > longest:
            raise BakeError(f"the name {name.removesuffix(SUFFIX)} is too long for that disk", "choose a shorter name")
    existing = folder and target.exists()
    if existing and replaced and _is_mount_point(target):
        raise BakeError(f"{target} is a mount point, which cannot be replaced", f"choose a folder in it as {option}")
    for place in (parent, *([target] if existing else [])):
        # Only an attempt tells: rights, quotas, disks that are read-only, folders that take no files.
        with tempfile.TemporaryFile(dir=place):
            pass


def _is_mount_point(path: Path) -> bool:
    if os.path.ismount(path):
        return True
    # A folder mounted from the same disk is told apart nowhere else.
    with contextlib.suppress(OSError):
        if sys.platform == "linux":
            with open("/proc/self/mountinfo", "rb") as table:
                return any(line.split(b" ")[4].decode("unicode_escape").encode("latin-1") == os.fsencode(path) for line in table)
    return False


def require_room(target: Path, size: int) -> None:
    """Raise BakeError if the disk of ``target`` has less than ``size`` bytes left, where it says."""
    try:
        free = shutil.disk_usage(_nearest(target.parent)).free
    except OSError:
        return
    if free < size:
        raise BakeError(f"{target.parent} has room for {free / 2**20:,.1f} MiB, and {target.name} takes at least "
                        f"{size / 2**20:,.1f} MiB", "free some space on that disk or write somewhere else")
