"""Whose a file is: an inventory names the files that we wrote, with their checksums; whatever else lies in a folder is the user's.

Nothing here follows a link: a link is never ours, for we write none.
"""

import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from .reading import sha256_of_file

# Left by file browsers in any folder they show; nobody misses them.
BYSTANDERS = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})


@dataclass(frozen=True)
class Stranger:
    """A file that we did not write, or that is no longer as we wrote it: ``name`` relative to its folder."""

    name: str
    changed: bool = False


def files_in(folder) -> Iterator[tuple[str, bool]]:
    """Every file below ``folder`` in order of their names, as its name relative to it with forward slashes, and whether it is an
    ordinary file; an empty folder below it counts as a file, with a slash behind it. Raises OSError."""
    yield from _walk(Path(folder), "")


def _walk(folder: Path, prefix: str) -> Iterator[tuple[str, bool]]:
    with os.scandir(folder) as found:
        entries = sorted(found, key=lambda entry: entry.name)
    for entry in entries:
        name = prefix + entry.name
        if not entry.is_dir(follow_symlinks=False):
            yield name, entry.is_file(follow_symlinks=False)
            continue
        empty = True
        for inner in _walk(Path(entry.path), name + "/"):
            empty = False
            yield inner
        if empty:
            yield name + "/", False


def is_file_of_ours(path, digest: str | None) -> bool:
    """True if ``path`` is an ordinary file with that checksum (None: whatever is in it). Raises OSError."""
    try:
        kind = os.lstat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    return stat.S_ISREG(kind) and (digest is None or sha256_of_file(path) == digest)


def first_stranger(folder, ours: Mapping[str, str | None], contents: bool = True) -> Stranger | None:
    """The first thing in ``folder`` that ``ours`` (name → checksum, None: not known) does not account for, or None. ``contents``
    also compares checksums. Empty folders are nobody's. Raises OSError."""
    for name, ordinary in files_in(folder):
        if name.endswith("/") or (ordinary and name.rpartition("/")[2] in BYSTANDERS):
            continue
        if not ordinary or name not in ours:
            return Stranger(name)
        if contents and not is_file_of_ours(Path(folder) / name, ours[name]):
            return Stranger(name, changed=True)
    return None


def remove_ours(folder, ours: Mapping[str, str | None]) -> Stranger | None:
    """Remove ``folder`` file by file if nothing in it is the user's; otherwise leave all of it and return the first thing that is.
    A folder that is not there is removed already. Raises OSError."""
    folder = Path(folder)
    try:
        if not stat.S_ISDIR(os.lstat(folder).st_mode):
            return Stranger("")
    except FileNotFoundError:
        return None
    stranger = first_stranger(folder, ours)
    if stranger is not None:
        return stranger
    for name, _ in list(files_in(folder)):
        if not name.endswith("/"):
            os.unlink(folder / name)
    remove_empty_folders(folder)
    return None


def remove_empty_folders(folder) -> None:
    """Remove ``folder`` and all folders below it, none of which may hold a file. Raises OSError if one does."""
    with os.scandir(folder) as found:
        inner = [entry.path for entry in found if entry.is_dir(follow_symlinks=False)]
    for path in inner:
        remove_empty_folders(path)
    os.rmdir(folder)
