"""What the control groups of Linux leave a process: containers, services and jobs of a cluster run in them.

Sources: cgroups(7), proc(5) (`/proc/self/cgroup`, `/proc/self/mountinfo`), the kernel's admin-guide/cgroup-v2 and
admin-guide/cgroup-v1/memory.
"""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

# A limit of version 1 that is not set reads as a number near 2^63.
_NO_LIMIT = 1 << 60


def group_bytes_left(root: Path = Path("/")) -> int | None:
    """Memory [bytes] that the strictest of this process's control groups and of those around them leaves; None without a limit.

    File cache that was not used lately counts as free, since it gives way. ``root`` is where the system's files are looked for.
    """
    lefts = [left for folder, version in _groups(root) if (left := _left(folder, version)) is not None]
    return max(min(lefts), 1) if lefts else None


@cache
def _groups(root: Path) -> tuple[tuple[str, int], ...]:
    """As ``_memberships``, which stay as they are for as long as a process runs: a bake asks often what they leave it."""
    return tuple((str(folder), version) for folder, version in _memberships(root))


def _memberships(root: Path) -> Iterator[tuple[Path, int]]:
    """Folder and version of every control group that this process's memory is counted in, innermost first."""
    try:
        memberships = [line.split(":", 2) for line in (root / "proc/self/cgroup").read_text().splitlines()]
        mounts = list(_mounts((root / "proc/self/mountinfo").read_text()))
    except (OSError, ValueError):
        return
    for number, controllers, path in (entry for entry in memberships if len(entry) == 3):
        version = 2 if number == "0" and not controllers else 1
        if version == 1 and "memory" not in controllers.split(","):
            continue
        for top, mounted_at, mounted_version in mounts:
            if mounted_version != version:
                continue
            # A container may see only its own part of the tree, under another name than the path has.
            inside = Path(path).relative_to(top) if Path(path).is_relative_to(top) and ".." not in path else Path()
            base = root / mounted_at.lstrip("/")
            for depth in range(len(inside.parts), -1, -1):
                yield base.joinpath(*inside.parts[:depth]), version
            break


def _mounts(text: str) -> Iterator[tuple[str, str, int]]:
    """(group at its top, where it is mounted, version) of every mounted tree of control groups that counts memory."""
    for line in text.splitlines():
        before, _, after = line.partition(" - ")
        fields, kinds = before.split(), after.split()
        if len(fields) < 5 or len(kinds) < 3:
            continue
        if kinds[0] == "cgroup2" or (kinds[0] == "cgroup" and "memory" in kinds[2].split(",")):
            # Spaces and the like are written as three octal digits.
            top, place = (re.sub(r"\\([0-7]{3})", lambda found: chr(int(found[1], 8)), field) for field in fields[3:5])
            yield top, place, 2 if kinds[0] == "cgroup2" else 1


def _left(folder: str, version: int) -> int | None:
    names = ("memory.max", "memory.current", "inactive_file") if version == 2 else \
        ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
    limits = [_number(f"{folder}/{names[0]}")]
    if version == 2:
        # Above it a group is not killed, but slowed down until nothing moves.
        limits.append(_number(f"{folder}/memory.high"))
    limits = [limit for limit in limits if limit is not None and limit < _NO_LIMIT]
    if not limits:
        return None
    used = _number(f"{folder}/{names[1]}")
    if used is None:
        return None
    return min(limits) - used + _statistic(f"{folder}/memory.stat", names[2])


def _number(file: str) -> int | None:
    try:
        with open(file) as stream:
            return int(stream.read())
    except (OSError, ValueError):  # no such file, or "max": no limit
        return None


def _statistic(file: str, name: str) -> int:
    try:
        with open(file) as stream:
            return next((int(line.split()[1]) for line in stream if line.split()[:1] == [name]), 0)
    except (OSError, ValueError, IndexError):
        return 0
