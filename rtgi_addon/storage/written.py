"""The list of what a run has written into its own folder, from which what somebody else put there can be told."""

import json
from pathlib import Path

_open: dict[Path, "Written"] = {}


class Written:
    """The list ``file`` of everything that this process writes into ``folder``. A name is in it before its file is made, so what a
    killed run left there can be told from what somebody else put beside it."""

    def __init__(self, file: Path, folder: Path):
        """Begin a new list. Raises OSError."""
        self.names: set[str] = set()
        self._folder = folder
        self._stream = open(file, "w", encoding="utf-8", newline="\n")
        _open[folder] = self

    def add(self, path: Path) -> None:
        """Say that ``path`` is about to be written. Raises OSError."""
        name = path.relative_to(self._folder).as_posix()
        if name not in self.names:
            self._stream.write(json.dumps(name) + "\n")
            self._stream.flush()
            self.names.add(name)

    def close(self) -> None:
        """No more will be written."""
        _open.pop(self._folder, None)
        self._stream.close()


def read_written(file) -> set[str]:
    """The names on the list ``file``; empty if there is none. A line that was cut short names nothing. Raises OSError."""
    try:
        lines = Path(file).read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return set()
    names = set()
    for line in lines:
        try:
            name = json.loads(line)
        except ValueError:
            continue
        if isinstance(name, str):
            names.add(name)
    return names


def list_of(path: Path) -> Written | None:
    """The list of the folder that ``path`` lies in, if this process is writing into it."""
    return next((written for folder, written in list(_open.items()) if path.is_relative_to(folder)), None)
