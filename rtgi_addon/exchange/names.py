"""Object names as folder names that every file system takes."""

import re

# Names that Windows keeps for devices, with or without an extension.
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
_MAX_LENGTH = 64


def folder_names(names, reserved=()) -> list[str]:
    """One safe folder name for each of ``names``, in order: ASCII, no separators, unique even where case does not count, and
    none of ``reserved``. The same names always give the same folders."""
    taken = {name.lower() for name in reserved}
    folders = []
    for name in names:
        stem = re.sub(r"[^A-Za-z0-9._-]+", "_", name)[:_MAX_LENGTH].strip("._ ") or "volume"
        if stem.split(".")[0].lower() in _DEVICES:
            stem = f"volume_{stem}"
        folder, count = stem, 2
        while folder.lower() in taken:
            folder, count = f"{stem}-{count}", count + 1
        taken.add(folder.lower())
        folders.append(folder)
    return folders
