"""What an interrupted run can be continued from: finished parts in a workplace, under a header that says which run they belong to.

Every part is a file of its own that says once more which run it is of, its name, and type and shape of every array in it, under a
checksum of all that. A part that is cut short, damaged, or of another run is refused, never used.
"""

import hashlib
import io
import json
import zipfile
import zlib
from pathlib import Path

import numpy as np

from ..errors import BakeError
from .files import disk_error, write_beside
from .parse import Refused, anything, digest, listing, parse_json, read_document, record, table, text, whole
from .reading import read_file
from .workplace import HEADER, Workplace

SCHEMA, PART_SCHEMA = "rtgi-checkpoint/2", b"rtgi-part/1 "
_ANEW = "run it without --resume to start over"
_HEADER = record({"schema": text, "run": table(text, text)})
_PART = record({"run": digest, "name": text, "arrays": table(text, record({"type": text, "shape": listing(whole(0))})),
                "document": table(text, anything)})
_DIGITS = 64


class Parts:
    """The parts in the workplace ``place`` of the run that depends on ``run`` (name → value or hash of what decides its result).

    ``resumed`` says that there were some already.
    """

    def __init__(self, place: Workplace, run: dict[str, str], *, resume: bool):
        """Without ``resume`` older parts are discarded. With it, those of another run are refused by BakeError, which names what
        differs and keeps them. Raises BakeError also for a header that is damaged and a disk that refuses."""
        self.folder = place.folder
        self._place, self._run = place, hashlib.sha256(json.dumps(run, sort_keys=True).encode()).hexdigest()
        try:
            if resume and (self.folder / HEADER).exists():
                _require_same(self.folder, run)
            else:
                place.discard_parts()
                write_beside(self.folder / HEADER, json.dumps({"schema": SCHEMA, "run": run}, indent=1).encode())
            self.resumed = place.has_parts()
        except OSError as error:
            raise disk_error(self.folder, error) from error

    def save(self, name: str, arrays: dict[str, np.ndarray], document: dict | None = None) -> None:
        """Store ``arrays`` and the JSON-able ``document`` under ``name`` in one step. Raises BakeError if the disk refuses."""
        buffer = io.BytesIO()
        # The prefix keeps names apart from the parameters of savez.
        np.savez(buffer, **{f"array.{key}": value for key, value in arrays.items()})
        about = {"run": self._run, "name": name, "arrays": {key: _form(np.asarray(value)) for key, value in arrays.items()},
                 "document": document or {}}
        head = json.dumps(about, allow_nan=False).encode() + b"\n"
        checksum = hashlib.sha256(head)
        checksum.update(buffer.getbuffer())
        path = self._path(name)
        try:
            write_beside(path, PART_SCHEMA + checksum.hexdigest().encode() + b"\n", head, buffer.getbuffer())
        except OSError as error:
            raise disk_error(path, error) from error

    def load(self, name: str) -> tuple[dict[str, np.ndarray], dict] | None:
        """The arrays and the document that were stored under ``name``, or None. Raises BakeError for a part that is damaged or of
        another run."""
        path = self._path(name)
        if not path.exists():
            return None
        try:
            head, arrays = _unpacked(memoryview(read_file(path, 1 << 40)))
        except Refused as error:
            raise BakeError(f"the checkpoint {path} is damaged, {error}", _ANEW) from error
        if head["run"] != self._run or head["name"] != name:
            raise BakeError(f"the checkpoint {path} belongs to another run", _ANEW)
        return arrays, head["document"]

    def remove(self) -> None:
        """Remove all of them: the result is written. Raises BakeError if the disk refuses."""
        try:
            self._place.discard_parts()
        except OSError as error:
            raise disk_error(self.folder, error, doing="remove") from error

    def _path(self, name: str) -> Path:
        return self.folder / f"{zlib.crc32(name.encode()):08x}.part"


def _form(value: np.ndarray) -> dict:
    return {"type": value.dtype.str, "shape": list(value.shape)}


def _unpacked(data: memoryview) -> tuple[dict, dict[str, np.ndarray]]:
    """The head and the arrays of a part. Raises Refused."""
    start = len(PART_SCHEMA) + _DIGITS + 1
    if bytes(data[:len(PART_SCHEMA)]) != PART_SCHEMA or bytes(data[start - 1:start]) != b"\n":
        raise Refused("it is no part of a checkpoint")
    if hashlib.sha256(data[start:]).hexdigest().encode() != bytes(data[len(PART_SCHEMA):start - 1]):
        raise Refused("its checksum is another")
    line = bytes(data[start:start + (1 << 24)]).partition(b"\n")[0]
    head = parse_json(line)
    _PART(head, "its head")
    try:
        with np.load(io.BytesIO(data[start + len(line) + 1:]), allow_pickle=False) as stored:
            arrays = {key.removeprefix("array."): stored[key] for key in stored.files}
    except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error) as error:
        raise Refused("its arrays cannot be read") from error
    if {key: _form(value) for key, value in arrays.items()} != head["arrays"]:
        raise Refused("its arrays are not those that it names")
    return head, arrays


def _require_same(folder: Path, run: dict[str, str]) -> None:
    before = read_document(folder / HEADER, SCHEMA, _HEADER, _ANEW)["run"]
    changed = [name for name in sorted(before.keys() | run.keys()) if before.get(name) != run.get(name)]
    if changed:
        what = ", ".join(_change(name, before, run) for name in changed)
        raise BakeError(f"the checkpoint {folder} belongs to another run, changed since: {what}",
                        "undo the change, or run it without --resume to start over")


def _change(name: str, before: dict, after: dict) -> str:
    if name.endswith("of the scene"):
        return name
    return f"{name} ({before.get(name, 'none')} before, {after.get(name, 'none')} now)"
