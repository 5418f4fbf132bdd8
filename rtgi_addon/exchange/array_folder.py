"""A folder of arrays under one JSON document that says what they are: the form in which work travels between machines.

The document names every file with its checksum; the folder is written whole or not at all, replaced only where all of it is ours
and unchanged, and read only where every byte is as it was written.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BakeError
from ..storage.array_file import ARRAY_INDEX, read_arrays, write_arrays
from ..storage.files import disk_error
from ..storage.owned import owned
from ..storage.parse import Check, digest, file_name, parse_document, record, require_inside, table, text
from ..storage.paths import check_output
from ..storage.reading import read_file, sha256_of_file
from ..storage.workplace import Workplace, replaced_of
from ..storage.writing import write_text

# The document of a scene with a hundred thousand objects has some 50 MB.
MOST_BYTES = 1 << 29


class Kind(NamedTuple):
    """A kind of folder: the name of its ``document`` and the document's ``schema``, what people call it (``word``, with its
    article), what to do about a damaged one (``remedy``), and the checks of the document's own ``entries``."""

    document: str
    schema: str
    word: str
    remedy: str
    entries: dict[str, Check]

    def check(self, value, where: str) -> None:
        """See storage/parse.py."""
        record({"schema": text, **self.entries, "arrays": table(file_name, ARRAY_INDEX), "sha256": table(file_name, digest)})(
            value, where)


class ArrayFolder(NamedTuple):
    """A folder that was read: its ``document``, that document's checksum, which stands for all of it, and the ``arrays`` of each
    file."""

    path: Path
    document: dict
    digest: str
    arrays: dict[str, dict[str, np.ndarray]]


def is_folder(kind: Kind, path) -> bool:
    """Whether a folder of this ``kind`` seems to be at ``path``."""
    return (Path(path) / kind.document).is_file()


def check_folder_target(kind: Kind, out, *, inputs=()) -> Path:
    """The absolute path of a folder of ``kind`` to be written to ``out`` while ``inputs`` are read. Raises BakeError for a path
    that will not do, and if ``out`` holds anything but such a folder as it was written."""
    path = check_output(out, replaced=True, inputs=inputs)
    ours(kind, path)
    return path


def ours(kind: Kind, path: Path, contents: bool = True) -> dict[str, str]:
    """What of the folder ``path`` is of a folder of ``kind`` (name → checksum), which must be all of it; ``contents`` also compares
    checksums. Raises BakeError for anything else that is there."""
    return owned(path, kind.document, lambda: _document(kind, path)[0]["sha256"], kind.word, contents)


def write_folder(kind: Kind, place: Workplace, document: dict, files: Mapping[str, Mapping[str, np.ndarray]]) -> Path:
    """Write ``document`` and the arrays of ``files`` as a folder of ``kind`` by way of ``place``, and return its path. Raises
    BakeError for a disk that refuses."""
    try:
        arrays = {name: write_arrays(place.new / name, values) for name, values in files.items()}
        sums = {name: sha256_of_file(place.new / name) for name in files}
        whole = {"schema": kind.schema, **document, "arrays": arrays, "sha256": sums}
        write_text(place.new / kind.document, json.dumps(whole, allow_nan=False) + "\n")
        stranger = place.put_folder(ours(kind, place.path, contents=False))
    except OSError as error:
        raise disk_error(place.path, error) from error
    if stranger is not None:
        raise BakeError(f"{place.path} was replaced while somebody put {stranger.name} there",
                        f"the new folder is whole; take what you need of {replaced_of(place.path)}, and remove that")
    return place.path


def read_folder(kind: Kind, path) -> ArrayFolder:
    """The folder of ``kind`` at ``path``, every file of it held to its checksum. Raises BakeError that names what is missing,
    damaged or of another version."""
    path = Path(path)
    document, sha256 = _document(kind, path)
    if sorted(document["arrays"]) != sorted(document["sha256"]):
        raise BakeError(f"{path / kind.document} is damaged, it names other files than it has checksums of", kind.remedy)
    arrays = {}
    for name, index in document["arrays"].items():
        file = require_inside(path, name)
        if sha256_of_file(file) != document["sha256"][name]:
            raise BakeError(f"{file} is damaged, it is not as it was written: its checksum is another", kind.remedy)
        arrays[name] = read_arrays(file, index, kind.remedy)
    return ArrayFolder(path, document, sha256, arrays)


def _document(kind: Kind, path: Path) -> tuple[dict, str]:
    if not is_folder(kind, path):
        raise BakeError(f"{path} is not {kind.word}, it has no {kind.document}" if path.is_dir() else f"there is no folder {path}",
                        kind.remedy)
    data = read_file(path / kind.document, MOST_BYTES)
    return parse_document(data, path / kind.document, kind.schema, kind.check, kind.remedy), hashlib.sha256(data).hexdigest()

