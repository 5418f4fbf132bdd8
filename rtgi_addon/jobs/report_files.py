"""Reports as sets of files: all of a report is replaced together, and only what nobody changed since we wrote it.

The report's JSON file names the others with their checksums, as the marker of an export does.
"""

import json
from pathlib import Path

from ..errors import BakeError
from ..exchange.plain import plain
from ..storage.files import disk_error
from ..storage.inventory import is_file_of_ours
from ..storage.merge import merge_into
from ..storage.parse import Refused, parse_json
from ..storage.paths import check_output
from ..storage.reading import read_file, sha256_of_file
from ..storage.workplace import Workplace, settle
from ..storage.writing import write_text

# Where the JSON file holds the checksums of the others.
FILES = "sha256"
_MOST_BYTES = 1 << 28
_MOVE = "move it away, or choose another --out"


def check_report(out, name: str, schema: str, files=(), inputs=()) -> Path:
    """The absolute path of the folder ``out`` for a report whose JSON file is ``name`` of ``schema`` and that always has the other
    ``files``, while ``inputs`` are read.

    Raises BakeError for a path that will not do, for files of an earlier report that were changed, and for others in their way:
    whatever is measured, they would be due with other content.
    """
    folder = check_output(out, inputs=inputs)
    settle(folder)
    base = base_of(folder, name, schema)
    for found, digest in base.items():
        if (folder / found).exists() and not is_file_of_ours(folder / found, digest):
            raise BakeError(f"{folder / found} was changed since it was written, and is due with other content", _MOVE)
    for due in (name, *files):
        if due not in base and (folder / due).exists():
            raise BakeError(f"{folder / due} is not of rtgi, and a file of that name is due", _MOVE)
    return folder


def base_of(folder: Path, name: str, schema: str) -> dict[str, str]:
    """What an earlier report in ``folder`` consists of: name → checksum as it was written. Raises BakeError for one without
    checksums, or one that cannot be read."""
    report = read_report(folder, name, schema)
    if report is None:
        return {}
    found = report.get(FILES)
    if not isinstance(found, dict) or not all(isinstance(digest, str) for digest in found.values()):
        raise BakeError(f"{folder / name} was written by an rtgi that kept no checksums", _MOVE)
    return {**found, name: sha256_of_file(folder / name)}


def read_report(folder: Path, name: str, schema: str) -> dict | None:
    """The content of the JSON file ``name`` in ``folder`` if it is a report of ``schema``, else None. Raises BakeError for a file
    that cannot be read."""
    path = folder / name
    if not path.is_file():
        return None
    try:
        content = parse_json(read_file(path, _MOST_BYTES))
    except Refused:
        return None
    return content if isinstance(content, dict) and content.get("schema") == schema else None


def put_report(place: Workplace, name: str, document: dict) -> None:
    """Put the files in ``place.new`` and ``document`` as the JSON file ``name`` into the report's folder, in the place of those of
    an earlier report. Raises BakeError, before anything is touched, for a file that somebody changed, and for a disk that refuses.
    """
    try:
        base = base_of(place.path, name, document["schema"])
        files = {item.relative_to(place.new).as_posix(): item for item in place.new.rglob("*") if item.is_file()}
        document = {**plain(document), FILES: {name: sha256_of_file(files[name]) for name in sorted(files)}}
        write_text(place.new / name, json.dumps(document, indent=1) + "\n")
        merge_into(place, base, indices=[name])
    except OSError as error:
        raise disk_error(place.path, error) from error
