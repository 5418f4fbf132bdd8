"""Whether a folder may be replaced: all that is in it must be ours, as it was written."""

from collections.abc import Callable, Mapping
from pathlib import Path

from ..errors import BakeError
from .files import disk_error
from .inventory import BYSTANDERS, Stranger, first_stranger
from .reading import sha256_of_file


def owned(path: Path, document: str, listed: Callable[[], Mapping[str, str]], what: str, contents: bool = True) -> dict[str, str]:
    """What of the folder ``path`` is ours (name → checksum): its ``document`` and the files that this names, which ``listed`` reads
    of it; all of the folder must be. Nothing of a folder that is not there. ``contents`` also compares checksums. ``what`` is what
    people call such a folder, with its article. Raises BakeError for anything that is not of it, that was changed since it was
    written, or that cannot be read."""
    try:
        if not path.is_dir():
            return {}
        if (path / document).is_file():
            ours = {**listed(), document: sha256_of_file(path / document)}
            stranger = first_stranger(path, ours, contents)
        else:
            ours = {}
            name = next((item.name for item in sorted(path.iterdir()) if item.name not in BYSTANDERS), None)
            stranger = None if name is None else Stranger(name)
    except OSError as error:
        raise disk_error(path, error) from error
    if stranger is None:
        return ours
    if stranger.changed:
        raise BakeError(f"{path} holds {stranger.name}, which was changed since it was written",
                        "choose another --out, or move that folder away")
    raise BakeError(f"{path} holds {stranger.name}, which is not part of {what}",
                    "choose another --out, or move that away: the whole folder is replaced")
