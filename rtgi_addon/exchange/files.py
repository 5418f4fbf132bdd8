"""What files need on every disk: one clear error per cause, flushed writes, folders swapped in one step."""

import errno
import os
import shutil
from pathlib import Path

from ..errors import BakeError

_REMEDIES = {
    errno.ENOSPC: "free some space on that disk or write somewhere else",
    errno.EDQUOT: "free some of your quota or write somewhere else",
    errno.EACCES: "choose a folder you may write to, or change its permissions",
    errno.EPERM: "choose a folder you may write to, or change its permissions",
    errno.EROFS: "choose a folder on a disk that is not read-only",
    errno.ENOENT: "create the folder first, or correct the path",
    errno.ENOTDIR: "correct the path: a part of it is a file",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def disk_error(path, error: OSError, doing: str = "write") -> BakeError:
    """The BakeError for a failed file operation: names ``path``, the system's own cause and its remedy."""
    code = error.errno
    reason = os.strerror(code) if code is not None else " ".join(str(error).split())
    return BakeError(f"cannot {doing} {path}, {reason[:1].lower()}{reason[1:]}", _REMEDIES.get(code, "check the disk"))


def sync_file(path) -> None:
    """Force a file's bytes to the disk. Raises OSError (a full disk may show only now)."""
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def sync_folder(path) -> None:
    """Force a folder's entries to the disk, where the system knows how (Windows does not)."""
    if os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_atomically(path, data: bytes) -> None:
    """Write a file so that ``path`` holds either the old bytes or all of the new ones. Raises OSError."""
    path = Path(path)
    temporary = path.with_name(path.name + ".new")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def remove_folder(path) -> None:
    """Remove a folder of ours with everything in it; nothing happens if it is not there. Raises OSError."""
    try:
        shutil.rmtree(path)
    except FileNotFoundError:
        return


def sibling(path, role: str) -> Path:
    """A name beside ``path`` on the same disk, so that a rename between them is one step: `NAME.role`."""
    path = Path(path)
    return path.with_name(f"{path.name}.{role}")


def recover_swap(path) -> None:
    """Finish what a ``swap_folder`` that was killed half-way left: the old folder comes back if the new one is not there.
    Raises OSError."""
    path, previous = Path(path), sibling(path, "rtgi-old")
    if not previous.is_dir():
        return
    if path.exists():
        remove_folder(previous)
    else:
        os.rename(previous, path)


def swap_folder(new, path) -> None:
    """Put folder ``new`` in the place of folder ``path`` (which may not exist yet). Both must be on one disk. Raises OSError.

    No system call swaps two folders on every platform, so the old one steps aside under a name that ``recover_swap`` knows;
    at every instant one of the two is whole on the disk.
    """
    path, previous = Path(path), sibling(path, "rtgi-old")
    recover_swap(path)
    if path.exists():
        os.rename(path, previous)
    try:
        os.rename(new, path)
    except OSError:
        if previous.exists():
            os.rename(previous, path)
        raise
    sync_folder(path.parent)
    remove_folder(previous)
