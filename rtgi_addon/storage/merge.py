"""Writing again into a folder where users work too: what of it is replaced, what stays, and what stands in the way.

Of every file three states are compared: as we wrote it last (``base``), as it is there, and as it is to be. A file that nobody
touched is replaced; one that somebody changed stays as long as we have nothing new to say in it.
"""

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import BakeError
from .inventory import is_file_of_ours
from .reading import sha256_of_file
from .workplace import Workplace
from .writing import write_file

# ``theirs`` and ``ours`` (bytes) of the file called ``name`` as one, or None where they cannot be brought together.
Blend = Callable[[str, bytes, bytes], bytes | None]


@dataclass
class Merge:
    """What becomes of a folder's files, by name: ``replaced`` and ``removed`` are those of ours with their checksums, ``kept``
    those that were changed since we wrote them."""

    replaced: dict[str, str] = field(default_factory=dict)
    removed: dict[str, str] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)


def merge_into(place: Workplace, base: Mapping[str, str], blend: Blend = lambda name, theirs, ours: None,
               indices: Collection[str] = ()) -> Merge:
    """Put what lies in ``place.new`` into the folder ``place.path``, where we wrote ``base`` (name → checksum) before. Readers find
    the other files through ``indices``, which are missing as long as those are on their way.

    Files that are nobody's of ours are not touched. Raises BakeError, before anything is, for one that was changed, or was never
    ours, where this time other content is due; OSError for a disk that refuses.
    """
    folder, merge, new = place.path, Merge(), place.new
    staged = {item.relative_to(new).as_posix(): sha256_of_file(item) for item in sorted(new.rglob("*")) if item.is_file()}
    same = set()
    for name, digest in staged.items():
        target = folder / name
        _require_folders(folder, name)
        if not os.path.lexists(target):
            continue
        if is_file_of_ours(target, digest):
            same.add(name)
            continue
        if name in base and is_file_of_ours(target, base[name]):
            merge.replaced[name] = base[name]
        elif not _blended(place, name, blend, merge):
            if base.get(name) != digest:
                remedy = "move it away, or choose another place"
                if name in base:
                    raise BakeError(f"{target} was changed since it was written, and is due with other content", remedy)
                raise BakeError(f"{target} is not of rtgi, and a file of that name is due", remedy)
            merge.kept.append(name)
    for name in base.keys() - staged.keys():
        if is_file_of_ours(folder / name, base[name]):
            merge.removed[name] = base[name]
        elif os.path.lexists(folder / name):
            merge.kept.append(name)
    merge.kept.sort()
    idle = {name for name in staged if os.path.lexists(folder / name) and name not in merge.replaced}
    if merge.removed or len(idle) < len(staged):
        # What they lead to changes, though they say the same.
        merge.replaced |= {name: staged[name] for name in same.intersection(indices)}
    for name in idle - merge.replaced.keys():
        (new / name).unlink()
    place.put_files(merge.replaced, merge.removed, indices)
    return merge


def _require_folders(folder: Path, name: str) -> None:
    inner = folder
    for part in name.split("/")[:-1]:
        inner = inner / part
        if os.path.lexists(inner) and not inner.is_dir():
            raise BakeError(f"{inner} is a file where a folder is due", "move it away, or choose another place")


def _blended(place: Workplace, name: str, blend: Blend, merge: Merge) -> bool:
    """Whether the file that is there and the one that is due could be brought together; the outcome then takes their place."""
    target = place.path / name
    if not is_file_of_ours(target, None):
        return False
    theirs = target.read_bytes()
    both = blend(name, theirs, (place.new / name).read_bytes())
    if both is None:
        return False
    if both != theirs:
        merge.replaced[name] = sha256_of_file(target)
        write_file(place.new / name, both)
    return True
