"""The marker of an export: it names every file that was written, so that the next export knows what it may replace.

There is one in the folder itself and one in each part of it that goes into projects alone, each for the files below it that no
other one names.
"""

import json
from pathlib import Path

from ...errors import BakeError
from ...storage.parse import digest, file_name, quoted, read_document, record, table, text
from ...storage.reading import sha256_of_file
from ...storage.writing import write_text
from ..schema import RTGI_VERSION

MARKER = "rtgi_export.json"
SCHEMA = "rtgi-export/2"
_CHECK = record({"schema": text, "engine": text, "rtgi": text, "files": table(file_name, digest)})
_REMEDY = "remove that export, or choose another --out"


def write_markers(folder: Path, engine: str, parts: tuple[str, ...], whole: bool = True) -> None:
    """Write the markers of everything in ``folder`` (name → checksum) for the engine of that name: in ``parts``, and in the folder
    itself if the ``whole`` export is there. Raises OSError."""
    names = sorted(item.relative_to(folder).as_posix() for item in folder.rglob("*") if item.is_file())
    for place in (*parts, *([""] if whole else [])):
        prefix = f"{place}/" if place else ""
        own = [name for name in names if name.startswith(prefix) and (place or not _in_a_part(name, parts))]
        files = {name.removeprefix(prefix): sha256_of_file(folder / name) for name in own}
        content = {"schema": SCHEMA, "engine": engine, "rtgi": RTGI_VERSION, "files": files}
        write_text(folder / f"{prefix}{MARKER}", json.dumps(content, indent=1) + "\n")


def read_markers(folder: Path, engine: str, parts: tuple[str, ...], whole: bool = True) -> dict[str, str]:
    """Every file (name relative to ``folder`` → checksum) that an earlier export to ``engine`` wrote into ``parts`` and, where it
    is ``whole``, beside them; the markers are among them. Empty without markers. Raises BakeError for one that is damaged, of
    another engine or of another version, OSError."""
    base: dict[str, str] = {}
    for place in (*parts, *([""] if whole else [])):
        marker = folder / place / MARKER
        if not marker.is_file():
            continue
        prefix = f"{place}/" if place else ""
        base |= {prefix + name: found for name, found in _read(marker, engine).items()}
        base[prefix + MARKER] = sha256_of_file(marker)
    return base


def _in_a_part(name: str, parts: tuple[str, ...]) -> bool:
    return any(name.startswith(f"{part}/") for part in parts)


def _read(path: Path, engine: str) -> dict[str, str]:
    content = read_document(path, SCHEMA, _CHECK, _REMEDY)
    if content["engine"] != engine:
        raise BakeError(f"{path.parent} holds an export to {quoted(content['engine'])}", "choose another --out")
    return content["files"]
