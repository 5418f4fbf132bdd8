"""A lock that names who holds it, and that is taken over once nobody does.

The system's own lock on the file (flock, LockFile) is given back when a process ends, however it ends, so a number that another
process has since can deceive nobody. It is not seen from other machines on every network disk: there the text in the file decides,
and a person has to say that the other machine is done. Where the disk knows no such locks at all, the process that the text names
is looked for by number and by the time of its start.
"""

import errno
import json
import os
import platform
import sys
import uuid
from datetime import datetime
from pathlib import Path

from ..errors import BakeError

if os.name == "nt":
    import msvcrt
else:
    import fcntl

LOCK = "rtgi-lock.json"
SCHEMA = "rtgi-lock/1"
# Every text has this length, so that it is written in one call over the one before.
_LENGTH = 1024
# On Windows a locked byte cannot be read either: one far behind the text.
_BYTE = 1 << 30
_FLAGS = os.O_RDWR | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
_HELD = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}
_NO_LOCKS = {errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}


class Lock:
    """The lock file in ``folder``, which must exist, held by this process while it does ``doing`` to ``path``."""

    def __init__(self, folder: Path, path: Path, doing: str):
        """Take it. Raises BakeError naming who has it, FileNotFoundError if the folder is gone, OSError for a disk that refuses."""
        self.file = folder / LOCK
        self._text = {"schema": SCHEMA, "for": path.name, "holder": {**_identity(), "doing": doing, "since": _now()}}
        while True:
            descriptor = os.open(self.file, _FLAGS | os.O_CREAT, 0o666)
            try:
                _require_nobody(descriptor, self.file, path)
                # Whoever had it may have removed the file between our opening and our locking it.
                if _same_file(descriptor, self.file):
                    _write(descriptor, self._text)
                    break
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)
        self._descriptor: int | None = descriptor

    def still_ours(self) -> bool:
        """False once somebody removed the file or took it over."""
        return read_lock(self.file) == self._text

    def release(self) -> None:
        """Give it back; the file stays, if it is there, and says that nobody holds it."""
        if self._descriptor is None:
            return
        try:
            _write(self._descriptor, {**self._text, "holder": None})
        except OSError:
            # Nobody misses the words: the system's own lock is what counts.
            pass
        os.close(self._descriptor)
        self._descriptor = None

    def remove(self, folder: Path) -> None:
        """Give it back, remove the file and the ``folder`` around it, which must hold nothing else. Raises OSError."""
        if os.name == "nt":
            # An open file cannot be removed there.
            self.release()
        os.unlink(self.file)
        os.rmdir(folder)


def require_free(folder: Path, path: Path) -> None:
    """Raise BakeError naming who holds the lock in ``folder``, if anybody does; takes nothing. Raises OSError."""
    try:
        descriptor = os.open(folder / LOCK, _FLAGS)
    except (FileNotFoundError, NotADirectoryError):
        return
    try:
        _require_nobody(descriptor, folder / LOCK, path)
    finally:
        os.close(descriptor)


def _require_nobody(descriptor: int, file: Path, path: Path) -> None:
    """Take the system's lock on ``descriptor``, or raise BakeError naming who has it."""
    locked = _try_lock(descriptor)
    before = _parsed(_content(descriptor))
    if before is None:
        raise BakeError(f"{file} is in the way, rtgi did not write it", "move it away, or choose another place")
    if locked is False or _alive_elsewhere(before.get("holder"), locked):
        raise _busy(path, file, before.get("holder"))


def read_lock(file) -> dict | None:
    """What a lock file says; an empty dictionary for one that was made and not written, None for anything else."""
    try:
        with open(file, "rb") as stream:
            return _parsed(stream.read(_LENGTH + 1))
    except OSError:
        return None


def _content(descriptor: int) -> bytes:
    os.lseek(descriptor, 0, os.SEEK_SET)
    return os.read(descriptor, _LENGTH + 1)


def _parsed(data: bytes) -> dict | None:
    if not data:
        return {}
    try:
        text = json.loads(data)
    except ValueError:
        return None
    return text if isinstance(text, dict) and text.get("schema") == SCHEMA else None


def _write(descriptor: int, text: dict) -> None:
    data = json.dumps(text).encode()
    os.lseek(descriptor, 0, os.SEEK_SET)
    os.write(descriptor, data.ljust(_LENGTH) if len(data) <= _LENGTH else data)


def _try_lock(descriptor: int) -> bool | None:
    """True: the system gave us the lock; False: another process has it; None: this disk has no locks."""
    try:
        if os.name == "nt":
            os.lseek(descriptor, _BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _HELD:
            return False
        if error.errno in _NO_LOCKS:
            return None
        raise
    return True


def _same_file(descriptor: int, file: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(file))
    except FileNotFoundError:
        return False


def _alive_elsewhere(holder, locked: bool | None) -> bool:
    """True if ``holder`` may still be at work although the system did not say so. ``locked`` is what ``_try_lock`` said."""
    if not isinstance(holder, dict):
        return False
    own = _identity()
    if own["boot"] and holder.get("boot") == own["boot"]:
        # The same running system; processes of another container on it cannot be seen.
        return locked is None and (holder.get("host") != own["host"] or _is_running(holder))
    if all(holder.get(name) == own[name] for name in ("machine", "host")):
        # Started anew since, or a system that does not number its starts.
        return locked is None and not own["boot"] and _is_running(holder)
    return True


def _is_running(holder: dict) -> bool:
    """Whether the process that ``holder`` names lives on this machine: its number may belong to another by now, which started at
    another time."""
    number = holder.get("process")
    if not isinstance(number, int) or number <= 0 or os.name == "nt":
        return False
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return holder.get("started") == _start_of(number)


def _identity() -> dict:
    """Who this process is, on which machine and since which start of it."""
    return {"process": os.getpid(), "started": _start_of(os.getpid()), "host": platform.node(), "machine": _machine(),
            "boot": _read("/proc/sys/kernel/random/boot_id")}


def _machine() -> str:
    return _read("/etc/machine-id") or f"{uuid.getnode():012x}"


def _start_of(process: int) -> str:
    """When a process started, in ticks since the machine did; "" where the system does not tell."""
    # The name of the program, in brackets, may hold anything.
    words = _read(f"/proc/{process}/stat").rpartition(")")[2].split()
    return words[19] if len(words) > 19 else ""


def _read(file: str) -> str:
    if sys.platform != "linux":
        return ""
    try:
        with open(file, encoding="utf-8", errors="replace") as stream:
            return stream.read().strip()
    except OSError:
        return ""


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")


def _busy(path: Path, file: Path, holder) -> BakeError:
    if not isinstance(holder, dict):
        return BakeError(f"another process is writing {path}", "wait until it is done, or choose another place")
    process, host, doing, since = (holder.get(name) for name in ("process", "host", "doing", "since"))
    remedy = "wait until it is done, or choose another place" if host == platform.node() else \
        f"wait until it is done, or remove {file} if it no longer runs"
    return BakeError(f"process {process} on {host} is writing {path} ({doing}, since {since})", remedy)
