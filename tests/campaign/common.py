"""What the parts of the campaign share: trials with a seed of their own, findings, and what lies in a folder."""

import contextlib
import hashlib
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
for place in (ROOT, ROOT / "tests/support"):
    if str(place) not in sys.path:
        sys.path.insert(0, str(place))

# What nothing may take [s, bytes]. A forked process begins with all that its parent holds.
MOST_SECONDS, MOST_BYTES = 10.0, 1 << 30


@dataclass
class Tally:
    """What a part of the campaign tried and found: ``counts`` by what it was, ``findings`` as (number of the trial, what went
    wrong)."""

    counts: dict[str, int] = field(default_factory=dict)
    findings: list[tuple[int, str]] = field(default_factory=list)
    seconds: float = 0.0
    slowest: float = 0.0
    largest: int = 0

    def count(self, what: str) -> None:
        """One more of ``what``."""
        self.counts[what] = self.counts.get(what, 0) + 1

    def costs(self, number: int, seconds: float, peak_bytes: int, most_seconds: float = MOST_SECONDS) -> None:
        """Note what trial ``number`` took; too much of it is a finding."""
        self.slowest, self.largest = max(self.slowest, seconds), max(self.largest, peak_bytes)
        if seconds > most_seconds:
            self.findings.append((number, f"took {seconds:.1f} s"))
        if peak_bytes > MOST_BYTES:
            self.findings.append((number, f"took {peak_bytes / 2**20:.0f} MiB"))

    def add(self, other: "Tally") -> None:
        """Add the figures of ``other``."""
        for what, count in other.counts.items():
            self.counts[what] = self.counts.get(what, 0) + count
        self.findings += other.findings
        self.seconds += other.seconds
        self.slowest, self.largest = max(self.slowest, other.slowest), max(self.largest, other.largest)


def rng_of(part: str, seed: int, number: int) -> np.random.Generator:
    """The random numbers of one trial, the same however many others there are."""
    return np.random.default_rng([int.from_bytes(part.encode()[:8], "big"), seed, number])


def snapshot(folder) -> dict[str, str]:
    """What lies in ``folder``: files by name with a checksum, links with where they lead, folders, and what else there is."""
    return {name: _content(path, kind) for name, path, kind in _below(folder)}


def stamps(folder) -> dict[str, tuple]:
    """What the system says of everything in ``folder``, which nothing can be written to without: kind, size, number, time."""
    return {name: (status.st_mode, status.st_size, status.st_ino, status.st_mtime_ns)
            for name, path, _ in _below(folder) for status in [os.lstat(path)]}


def _below(folder, prefix: str = ""):
    """Name (a folder's with a slash), path and kind of everything in ``folder``, if there is such a folder."""
    with contextlib.suppress(FileNotFoundError), os.scandir(folder) as found:
        for entry in found:
            name = prefix + entry.name
            if entry.is_symlink():
                yield name, entry.path, "link"
            elif entry.is_dir():
                yield name + "/", entry.path, "folder"
                yield from _below(entry.path, name + "/")
            else:
                yield name, entry.path, "file" if entry.is_file() else "something else"


def _content(path, kind: str) -> str:
    if kind == "link":
        return f"link to {os.readlink(path)}"
    if kind != "file":
        return kind
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def differences(before: dict, after: dict) -> str:
    """What changed between two snapshots, as a few words; "" if nothing did."""
    gone, new = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
    changed = sorted(name for name in before.keys() & after.keys() if before[name] != after[name])
    parts = [f"{word} {', '.join(names[:4])}" for word, names in (("gone:", gone), ("new:", new), ("changed:", changed)) if names]
    return "; ".join(parts)
