"""A series of bundles, one a keyframe: `OUT/series.json` beside the folders of the bundles (docs/formats.md)."""

import json
from dataclasses import dataclass
from pathlib import Path

from ..storage.parse import (
    MAX_BYTES,
    Refused,
    anything,
    digest,
    exactly,
    file_name,
    listing,
    number,
    parse_document,
    record,
    table,
    text,
    whole,
)
from ..storage.reading import read_file
from ..storage.workplace import workplace
from ..storage.writing import write_file
from .schema import RTGI_VERSION
from .schema import SERIES as INDEX

SCHEMA = "rtgi-series/1"
# Blender's first and last frame (MINAFRAME, MAXFRAME).
_FRAMES = -1048574, 1048574
_RESTORE = "restore the series, or bake it again"
_frame = whole(*_FRAMES)
_KEYFRAME = record({"frame": _frame, "bundle": file_name, "state": digest})
_SERIES = record({"schema": exactly(SCHEMA), "scene": text, "rtgi": text, "technique": text, "settings": table(text, anything),
                  "seed": whole(), "first": _frame, "last": _frame, "step": whole(1), "frames_per_second": number(0.0),
                  "frames": listing(_KEYFRAME)})


@dataclass(frozen=True)
class Keyframe:
    """The ``bundle`` (a folder's name in the series) of one ``frame``, and the ``state`` of all that decided it (a digest)."""

    frame: int
    bundle: str
    state: str


@dataclass(frozen=True)
class Series:
    """What `series.json` in the folder ``path`` says: which frames were to be baked, and the ``frames`` that are, ascending.
    Frames whose scenes are the same share a bundle."""

    path: Path
    scene: str
    technique: str
    settings: dict
    seed: int
    first: int
    last: int
    step: int
    frames_per_second: float
    frames: tuple[Keyframe, ...] = ()

    @property
    def wanted(self) -> range:
        """The frames that it is to have."""
        return range(self.first, self.last + 1, self.step)

    @property
    def bundles(self) -> tuple[Path, ...]:
        """The folders of its bundles, each once."""
        return tuple(self.path / name for name in dict.fromkeys(entry.bundle for entry in self.frames))

    def at(self, frame: float) -> Keyframe:
        """What ``frame`` shows: the keyframe there or the last one before it, and before the first, the first."""
        return next((entry for entry in reversed(self.frames) if entry.frame <= frame), self.frames[0])


def bundle_at(series: Series, frame: float) -> tuple[Path, tuple[str, ...]]:
    """The folder of the bundle that ``frame`` shows, and a line for the user where that is not its own."""
    found = series.at(frame)
    told = () if found.frame == frame else (f"Frame {frame:g} shows the bake of frame {found.frame}",)
    return series.path / found.bundle, told


def is_series(folder) -> bool:
    """Whether there is a series in ``folder``."""
    return (Path(folder) / INDEX).is_file()


def read_series(folder) -> Series:
    """The series in ``folder``. Raises BakeError naming what is wrong with it."""
    path = Path(folder) / INDEX
    document = parse_document(read_file(path, MAX_BYTES), path, SCHEMA, _check, _RESTORE)
    entries = tuple(Keyframe(entry["frame"], entry["bundle"], entry["state"]) for entry in document["frames"])
    return Series(Path(folder), *(document[name] for name in (
        "scene", "technique", "settings", "seed", "first", "last", "step", "frames_per_second")), entries)


def write_series(series: Series) -> None:
    """Put ``series`` in the place of what is in its folder. Raises BakeError, OSError."""
    document = {
        "schema": SCHEMA, "scene": series.scene, "rtgi": RTGI_VERSION, "technique": series.technique, "settings": series.settings,
        "seed": series.seed, "first": series.first, "last": series.last, "step": series.step,
        "frames_per_second": series.frames_per_second,
        "frames": [{"frame": entry.frame, "bundle": entry.bundle, "state": entry.state} for entry in series.frames]}
    with workplace(series.path / INDEX, "bake") as place:
        write_file(place.new / INDEX, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())
        place.put_file()


def folder_of(frame: int) -> str:
    """What the bundle of ``frame`` is called."""
    return f"frame_{frame:04d}" if frame >= 0 else f"frame_minus_{-frame:04d}"


def _check(document: dict, where: str) -> None:
    _SERIES(document, where)
    frames = [entry["frame"] for entry in document["frames"]]
    for entry in document["frames"]:
        if "/" in entry["bundle"]:
            raise Refused(f"bundle {entry['bundle']!r} is not the name of a folder beside it")
    if not frames or frames != sorted(set(frames)):
        raise Refused("its frames are none, or not in order")
