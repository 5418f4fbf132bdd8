"""What is there makes room for what was written (workplace.py), in steps that any later run can finish or take back.

Nothing is decided before `commit.json` is on the disk. From then on the exchange of a folder is taken back as long as the new one
is not in its place, and that of a set of files is finished. Of a set, the files through which readers find the others (its indices)
go first and come last: whoever reads it half-way finds none, never an old and a new half.
"""

import json
import os
from collections.abc import Collection, Mapping
from pathlib import Path

from ..errors import BakeError
from .files import sync_folder, write_beside
from .inventory import Stranger, files_in, first_stranger, is_file_of_ours, remove_ours
from .reading import sha256_of_file
from .written import read_written

NEW, OLD, COMMIT, WRITTEN = "new", "old", "commit.json", "written.txt"
SCHEMA = "rtgi-commit/1"


def put_folder(folder: Path, path: Path, ours: Mapping[str, str]) -> Stranger | None:
    """See Workplace.put_folder."""
    new, old = folder / NEW, folder / OLD
    if not _is_empty(path):
        _commit(folder, {"old": dict(ours)})
        os.rename(path, old)
        try:
            os.rename(new, path)
        except OSError:
            os.rename(old, path)
            raise
    else:
        # On POSIX the new folder takes the place of an empty one in one step, and on Windows it takes no place.
        if os.name == "nt" and path.exists():
            path.rmdir()
        os.rename(new, path)
    sync_folder(path.parent)
    return _finish_folder(folder, ours)


def _finish_folder(folder: Path, ours: Mapping[str, str]) -> Stranger | None:
    stranger = remove_ours(folder / OLD, ours)
    if stranger is None:
        (folder / COMMIT).unlink(missing_ok=True)
    return stranger


def put_files(folder: Path, path: Path, replaced: Mapping[str, str | None], removed: Mapping[str, str],
              indices: Collection[str] = ()) -> None:
    """See Workplace.put_files."""
    if _is_empty(path):
        put_folder(folder, path, {})
        return
    new = folder / NEW
    placed = {name: [sha256_of_file(new / name), replaced.get(name)] for name, _ in files_in(new) if not name.endswith("/")}
    content = {"placed": placed, "removed": dict(removed), "indices": sorted(set(indices) & (placed.keys() | removed.keys()))}
    _commit(folder, content)
    _finish_files(folder, path, content)


def _finish_files(folder: Path, path: Path, content: dict) -> None:
    placed, removed, indices = content["placed"], content["removed"], content.get("indices", ())
    gone = {name: before for name, (_, before) in placed.items() if name in indices and (folder / NEW / name).exists()}
    _remove(path, gone | {name: digest for name, digest in removed.items() if name in indices})
    _place(folder, path, {name: digests for name, digests in placed.items() if name not in indices})
    _remove(path, removed)
    _place(folder, path, {name: digests for name, digests in placed.items() if name in indices})
    (folder / COMMIT).unlink()


def _place(folder: Path, path: Path, files: Mapping[str, tuple[str, str | None]]) -> None:
    """Put the ``files`` (name → checksums of the new one and of the one before) that lie in `new` into ``path``, as far as nobody
    changed what is there. Raises BakeError naming one that somebody did, OSError."""
    changed = []
    for name, (digest, before) in files.items():
        source, target = folder / NEW / name, path / name
        if not source.exists():
            continue
        if os.path.lexists(target) and not any(known and is_file_of_ours(target, known) for known in (before, digest)):
            changed.append(name)
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(source, target)
    for inner in {(path / name).parent for name in files}:
        sync_folder(inner)
    if changed:
        raise BakeError(f"{path / changed[0]} was changed while it was being replaced",
                        f"take what you need of {folder / NEW}, remove {folder} and try again")


def _remove(path: Path, files: Mapping[str, str | None]) -> None:
    """Remove those of ``files`` (name → checksum, None: there was none) that are in ``path`` as we wrote them, and folders that are
    empty then. Raises OSError."""
    for name, digest in files.items():
        target = path / name
        if digest is not None and is_file_of_ours(target, digest):
            target.unlink()
            sync_folder(target.parent)
            _remove_empty(target.parent, path)


def recover(folder: Path, path: Path) -> Stranger | None:
    """Finish or take back what a run that was killed had begun in ``folder``. The first thing in the way that is not ours, or None;
    then nothing was touched. Raises BakeError, OSError."""
    content, written = _read_commit(folder / COMMIT), dict.fromkeys(read_written(folder / WRITTEN))
    replaced = None if content is None else content.get("old", {})
    for inner, ours in ((OLD, replaced), (NEW, written)):
        if (folder / inner).exists():
            stranger = first_stranger(folder / inner, ours or {})
            if stranger is not None:
                return Stranger(f"{inner}/{stranger.name}", stranger.changed)
    if content is not None and "placed" in content:
        _finish_files(folder, path, content)
    elif (folder / OLD).exists():
        if _is_empty(path):
            if path.exists():
                path.rmdir()
            os.rename(folder / OLD, path)
            sync_folder(path.parent)
        remove_ours(folder / OLD, replaced or {})
    (folder / COMMIT).unlink(missing_ok=True)
    remove_ours(folder / NEW, written)
    (folder / WRITTEN).unlink(missing_ok=True)
    return None


def _commit(folder: Path, content: dict) -> None:
    write_beside(folder / COMMIT, json.dumps({"schema": SCHEMA, **content}, indent=1).encode())
    sync_folder(folder)


def _read_commit(file: Path) -> dict | None:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError:
        content = None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA or not _is_plain(content):
        raise BakeError(f"{file} is damaged", "look what is in that folder, and remove it")
    return content


def _is_plain(content: dict) -> bool:
    def names(key: str, valid) -> bool:
        part = content.get(key, {})
        return isinstance(part, dict) and all(is_inside(name) and valid(value) for name, value in part.items())

    def pair(value) -> bool:
        return isinstance(value, list) and len(value) == 2 and isinstance(value[0], str) and isinstance(value[1], (str, type(None)))

    indices = content.get("indices", [])
    return names("old", lambda value: isinstance(value, str)) and names("removed", lambda value: isinstance(value, str)) \
        and names("placed", pair) and isinstance(indices, list) and all(isinstance(name, str) for name in indices)


def is_inside(name: str) -> bool:
    """Whether ``name``, with forward slashes, names something below the folder that it is relative to."""
    parts = name.split("/")
    return bool(name) and "\\" not in name and ":" not in name and not any(part in ("", ".", "..") for part in parts)


def _is_empty(path: Path) -> bool:
    """Whether nothing is lost if ``path`` goes: it is not there, or an empty folder. Raises OSError."""
    try:
        with os.scandir(path) as found:
            return next(found, None) is None
    except FileNotFoundError:
        return True


def _remove_empty(folder: Path, top: Path) -> None:
    while folder != top:
        try:
            folder.rmdir()
        except OSError:
            return
        folder = folder.parent
