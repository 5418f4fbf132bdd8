"""Reading files that anyone may have put where ours should be: ordinary files alone, and never more of them than they may hold.

A pipe or a device in a file's place would keep a reader waiting for ever, or never end.
"""

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..errors import BakeError
from .files import disk_error

_CORRECT = "correct the path, or restore the file"


@contextmanager
def open_file(path) -> Iterator[tuple[BinaryIO, int]]:
    """The ordinary file at ``path``, open for reading, and its size [bytes]. Raises BakeError for one that is missing, refused or
    anything else (a folder, a pipe, a device), also if reading it fails later."""
    path = Path(path)
    try:
        # Looked at before it is opened, since opening a device may already do something; and after, since it may have changed.
        _require_ordinary(path, os.stat(path))
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            _require_ordinary(path, status)
            yield file, status.st_size
    except OSError as error:
        raise disk_error(path, error, doing="read") from error


def read_file(path, limit: int) -> bytes:
    """The bytes of the ordinary file at ``path``. Raises BakeError as ``open_file`` does, and for one of more than ``limit``
    bytes, before any is read."""
    with open_file(path) as (file, size):
        if size > limit:
            raise BakeError(f"{path} has {size:,} bytes, which is more than the {limit:,} it may have", _CORRECT)
        # One byte more than there should be tells a file that grows while it is read, without asking memory for what may come.
        data = file.read(size + 1)
    if len(data) > size > 0:
        raise BakeError(f"{path} grew while it was read", "wait until it is written, and try again")
    return data


def sha256_of_file(path) -> str:
    """SHA-256 of the ordinary file at ``path`` as 64 hexadecimal digits. Raises BakeError as ``open_file`` does."""
    with open_file(path) as (file, _):
        return hashlib.file_digest(file, "sha256").hexdigest()


def _require_ordinary(path: Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise BakeError(f"{path} is a folder where a file should be", _CORRECT)
    if not stat.S_ISREG(status.st_mode):
        raise BakeError(f"{path} is a pipe, a device or a socket, not a file", _CORRECT)
