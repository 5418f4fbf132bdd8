"""What files need on every disk: one clear error per cause, flushed writes, files that are whole or not there."""

import errno
import os
from pathlib import Path

from ..errors import BakeError

_REMEDIES = {
    errno.ENOSPC: "free some space on that disk or write somewhere else",
    errno.EDQUOT: "free some of your quota or write somewhere else",
    errno.EFBIG: "write to a disk that takes files of this size",
    errno.EACCES: "choose a folder you may write to, or change its permissions",
    errno.EPERM: "choose a folder you may write to, or change its permissions",
    errno.EROFS: "choose a folder on a disk that is not read-only",
    errno.ENOENT: "create the folder first, or correct the path",
    errno.ENOTDIR: "correct the path: a part of it is a file",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.ELOOP: "correct the path: its links lead in a circle",
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


def sync_tree(folder) -> None:
    """Force everything in ``folder`` to the disk. Raises OSError."""
    for item in Path(folder).rglob("*"):
        if item.is_dir():
            sync_folder(item)
        else:
            sync_file(item)
    sync_folder(folder)


def write_beside(path, *chunks: bytes | memoryview) -> None:
    """Write ``chunks``, one after the other, as a file in a folder of ours, so that ``path`` holds either the old bytes or all of
    the new ones. Raises OSError."""
    path = Path(path)
    temporary = path.with_name(path.name + TEMPORARY)
    try:
        with open(temporary, "wb") as file:
            for chunk in chunks:
                file.write(chunk)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


# What ``write_beside`` adds to a name.
TEMPORARY = ".tmp"
