"""The functions through which every file of ours gets to a disk: listed first where a whole folder is being written, and otherwise
beside its place and renamed.
"""

import os
import shutil
from pathlib import Path

from .workplace import workplace
from .written import list_of


def write_file(path, data) -> Path:
    """Write ``data`` (bytes) as the file ``path`` and return it; folders are made as needed inside a workplace's ``new``.

    There it is listed first, and stays when all of the folder is put in place. Anywhere else the file is replaced in one step by
    way of a workplace of its own. Raises OSError, and BakeError if another process is writing the same file.
    """
    path = Path(path).absolute()
    written = list_of(path)
    if written is None:
        path = path.resolve()
        with workplace(path, "write") as place:
            write_file(place.new / path.name, data)
            place.put_file()
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    written.add(path)
    with open(path, "wb") as file:
        file.write(data)
    return path


def write_text(path, text: str) -> Path:
    """Write ``text`` as UTF-8 with Unix line ends on every system; see ``write_file``."""
    return write_file(path, text.encode("utf-8"))


def copy_file(source, path) -> Path:
    """Copy the file ``source`` into a workplace's ``new``; see ``write_file``."""
    path = Path(path).absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    claim(path)
    shutil.copyfile(source, path)
    return path


def claim(path) -> Path:
    """List ``path`` inside a workplace's ``new``, for what others write there (Blender's pictures). Raises OSError."""
    path = Path(path).absolute()
    written = list_of(path)
    if written is None:
        raise ValueError(f"{path} is in no workplace")
    os.makedirs(path.parent, exist_ok=True)
    written.add(path)
    return path
