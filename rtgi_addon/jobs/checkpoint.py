"""The checkpoint of a bake: a folder beside the bundle with the parts that are finished.

Every part is written to a temporary name, flushed and renamed, so a process killed at any instant leaves whole parts only.
"""

import io
import json
import shutil
import time
import zipfile
import zlib
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..exchange.files import disk_error, remove_folder, sibling, write_atomically
from ..techniques import Checkpoint

SCHEMA = "rtgi-checkpoint/1"
_HEADER = "checkpoint.json"


class FileCheckpoint(Checkpoint):
    """Parts as `.npz` files in `OUT.partial`, with a header that says what bake they belong to.

    ``due`` turns true ``interval`` seconds after the last save (0: always). ``resumed`` says that parts were found.
    """

    def __init__(self, out: Path, parts: dict[str, str], *, resume: bool, interval: float = 10.0):
        """Open the checkpoint of the bake to ``out`` that depends on ``parts`` (``jobs.fingerprint``).

        Without ``resume`` an older checkpoint is discarded. With it, one of another bake is refused by BakeError, which
        names what differs and keeps the files. Raises BakeError also where the folder cannot be written.
        """
        self.folder = sibling(out, "partial")
        self.interval = interval
        self.resumed = False
        try:
            if resume and (self.folder / _HEADER).is_file():
                self._require_same(parts)
                self.resumed = any(self.folder.glob("*.npz"))
            else:
                self._discard_old()
                self.folder.mkdir()
                write_atomically(self.folder / _HEADER, json.dumps({"schema": SCHEMA, "parts": parts}, indent=1).encode())
        except OSError as error:
            raise disk_error(self.folder, error) from error
        self._last = time.monotonic()

    @property
    def due(self) -> bool:
        """True if the last ``save`` lies ``interval`` seconds back."""
        return time.monotonic() - self._last >= self.interval

    def save(self, name: str, arrays: dict[str, np.ndarray]) -> None:
        """Store ``arrays`` under ``name`` in one step. Raises BakeError if the disk refuses."""
        buffer = io.BytesIO()
        # The prefix keeps names apart from the parameters of savez.
        np.savez(buffer, **{f"array.{key}": value for key, value in arrays.items()})
        path = self._path(name)
        try:
            write_atomically(path, buffer.getbuffer())
        except OSError as error:
            raise disk_error(path, error) from error
        self._last = time.monotonic()

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        """What was stored under ``name``, or None. Raises BakeError for a damaged file."""
        path = self._path(name)
        try:
            with np.load(path, allow_pickle=False) as stored:
                return {key.removeprefix("array."): stored[key] for key in stored.files}
        except FileNotFoundError:
            return None
        except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error) as error:
            raise BakeError(f"the checkpoint {path} is damaged", "bake without --resume to start over") from error

    def remove(self) -> None:
        """Remove the checkpoint: the bundle is written, or nothing was stored. Raises BakeError if the disk refuses."""
        try:
            remove_folder(self.folder)
        except OSError as error:
            raise disk_error(self.folder, error, doing="remove") from error

    def remove_if_empty(self) -> None:
        """Remove the folder if it holds no part that a later ``--resume`` could use."""
        if not any(self.folder.glob("*.npz")):
            shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self, name: str) -> Path:
        return self.folder / f"{zlib.crc32(name.encode()):08x}.npz"

    def _discard_old(self) -> None:
        if not self.folder.exists():
            return
        if not self.folder.is_dir() or not all(_is_ours(item) for item in self.folder.iterdir()):
            raise BakeError(f"{self.folder} is in the way, it is no checkpoint", "move it away or choose another --out")
        remove_folder(self.folder)

    def _require_same(self, parts: dict[str, str]) -> None:
        try:
            header = json.loads((self.folder / _HEADER).read_text(encoding="utf-8"))
            before = dict(header["parts"]) if header["schema"] == SCHEMA else None
        except (ValueError, KeyError, TypeError):
            before = None
        if before is None:
            raise BakeError(f"the checkpoint {self.folder} is damaged", "bake without --resume to start over")
        changed = [name for name in sorted(before.keys() | parts.keys()) if before.get(name) != parts.get(name)]
        if changed:
            what = ", ".join(_change(name, before, parts) for name in changed)
            raise BakeError(f"the checkpoint {self.folder} belongs to another bake, changed since: {what}",
                            "undo the change, or bake without --resume to start over")


def _is_ours(item: Path) -> bool:
    name = item.name.removesuffix(".new")
    return name == _HEADER or name.endswith(".npz")


def _change(name: str, before: dict, after: dict) -> str:
    if name.endswith("of the scene"):
        return name
    return f"{name} ({before.get(name, 'none')} before, {after.get(name, 'none')} now)"
