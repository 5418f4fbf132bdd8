"""A series: one bundle a keyframe, from scenes that are read one after the other."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from .. import techniques
from ..effects.atlas.settings import AtlasSettings
from ..effects.spheres.settings import SphereSettings
from ..errors import BakeError, Cancelled, UsageError
from ..exchange.bundle import check_target
from ..exchange.plain import plain
from ..exchange.schema import MANIFEST, read_manifest
from ..exchange.series import Keyframe, Series, folder_of, is_series, read_series, write_series
from ..progress import Progress
from ..scene import Scene
from ..scene.content import content_hash
from ..storage.paths import check_output
from ..storage.workplace import workplace
from ..techniques.kernels import Kernels
from ..techniques.scattered.settings import ScatterSettings
from ..words import as_lines
from .bake import bake_scene, require_device
from .console import duration
from .fingerprint import fingerprint
from .ready import select_volumes
from .report import BakeSummary
from .settings import build_settings

# The share of a frame's progress that reading it takes.
_READ = 0.1


@dataclass(frozen=True)
class SeriesSummary:
    """A finished series: ``baked`` are the summaries of the bundles that were baked now, by frame; ``kept`` the frames that an
    earlier run had baked, ``shared`` those (frame, frame) whose scene is that of another one."""

    series: Series
    baked: dict[int, BakeSummary]
    kept: tuple[int, ...]
    shared: tuple[tuple[int, int], ...]

    def _lines(self) -> list[str]:
        """What the bundles say, each line once with the frames that it is about."""
        said: dict[str, list[int]] = {}
        for frame, summary in self.baked.items():
            lines = [*(f"  note     {note}" for note in summary.notes), *(f"  omitted  {entry}" for entry in summary.not_followed),
                     *(f"  warning  {warning}" for warning in summary.warnings)]
            for line in lines:
                said.setdefault(line, []).append(frame)
        every = len(self.baked)
        return [line if len(frames) == every else f"{line} (frames {frames_text(frames)})" for line, frames in said.items()]

    @property
    def seconds(self) -> float:
        """Wall-clock time of all bakes."""
        return sum(sum(summary.seconds.values()) for summary in self.baked.values())

    def to_json(self) -> dict:
        """The summary as JSON-able values."""
        series = self.series
        return plain({
            "series": str(series.path), "technique": series.technique, "settings": series.settings, "seed": series.seed,
            "first": series.first, "last": series.last, "step": series.step, "frames_per_second": series.frames_per_second,
            "frames": [{"frame": entry.frame, "bundle": entry.bundle} for entry in series.frames], "kept": list(self.kept),
            "shared": [list(pair) for pair in self.shared],
            "baked": {str(frame): summary.to_json() for frame, summary in self.baked.items()}})

    def to_text(self) -> str:
        """The summary as lines for a person."""
        series = self.series
        frames = [entry.frame for entry in series.frames]
        rays, bundles = sum(summary.rays for summary in self.baked.values()), len(series.bundles)
        return as_lines([
            f"Baked {series.path} with {series.technique}, seed {series.seed}: {len(frames)} frames in {bundles} bundles",
            f"  frames   {frames_text(frames)}",
            *([f"  kept     {frames_text(self.kept)}, as an earlier run had baked them"] if self.kept else []),
            *([f"  shared   {frames_text([frame for frame, _ in self.shared])}: the same scene as an earlier frame"]
              if self.shared else []),
            f"  rays     {rays:,}",
            f"  time     {duration(self.seconds)}",
            *self._lines(),
        ])


def frames_text(frames) -> str:
    """Ascending frames for a person: runs of one step as "first to last by step"."""
    parts, frames = [], list(frames)
    while frames:
        step = frames[1] - frames[0] if len(frames) > 1 else 1
        count = 1
        while count < len(frames) and frames[count] - frames[count - 1] == step:
            count += 1
        if count < 3:
            count = 1
            parts.append(str(frames[0]))
        else:
            parts.append(f"{frames[0]} to {frames[count - 1]}" + (f" by {step}" if step != 1 else ""))
        frames = frames[count:]
    return ", ".join(parts)


def bake_series(read_frame: Callable[[int, Progress], Scene], frames: range, technique: str, overrides: dict, out, *,
                frames_per_second: Callable[[], float], base: dict | None = None, seed: int = 0, threads: int | None = None,
                resume: bool = False, volume=None, checkpoint_seconds: float = 10.0, device: str = "cpu",
                kernels: Kernels | None = None, spheres: SphereSettings | None = None, atlas: AtlasSettings | None = None,
                placement: ScatterSettings | None = None, inputs=(), progress: Progress | None = None) -> SeriesSummary:
    """Bake ``frames`` with the technique called ``technique`` into bundles in the folder ``out``, with an index that at any time
    names what is whole. ``read_frame`` reads the scene of a frame, ``frames_per_second`` is asked once one is read; all else is as
    in ``bake_scene``.

    A frame whose scene is the same as that of one before it shares its bundle. With ``resume`` frames are kept that an earlier run
    baked from the same scene. Raises what ``bake_scene`` does, with the frame in the message; what was baked before stays.
    """
    progress = progress or Progress()
    method = techniques.get(technique)
    settings = build_settings(method, {**(base or {}), **overrides})
    require_device(method, device)
    scatters = placement is not None and placement.scatters
    folder = check_series_target(out, inputs)
    before = {}
    if resume and is_series(folder):
        before = {entry.bundle: entry.state for entry in read_series(folder).frames}
    with workplace(folder, "bake"):
        folder.mkdir(exist_ok=True)
        series, baked, kept, shared = None, {}, [], []
        known: dict[str, Keyframe] = {}
        for index, frame in enumerate(frames):
            part = progress.span(index / len(frames), (index + 1) / len(frames)).apart()
            try:
                part.step(0.0, f"Frame {frame}: reading the scene")
                scene = read_frame(frame, part.span(0.0, _READ))
                scene = replace(scene, volumes=select_volumes(scene.volumes, volume, overrides))
                state = _digest({**fingerprint(scene, technique, settings, seed), "spheres": content_hash(scene.spheres),
                                 "settings of spheres": repr(spheres), "settings of the atlas": repr(atlas),
                                 "placement": repr(placement),
                                 "places for probes": content_hash(scene.probe_points if scatters else {}),
                                 "atlas": repr([(item.name, item.atlas) for item in scene.instances if item.atlas is not None])})
                bundle = folder_of(frame)
                if state in known:
                    bundle = known[state].bundle
                    shared.append((frame, known[state].frame))
                # Under its own name alone: bundles of other frames may be replaced yet.
                elif before.get(bundle) == state and _is_whole(folder / bundle):
                    kept.append(frame)
                else:
                    baked[frame] = bake_scene(
                        scene, technique, overrides, folder / bundle, base=base, seed=seed, threads=threads, resume=resume,
                        volume=volume, checkpoint_seconds=checkpoint_seconds, device=device, kernels=kernels, spheres=spheres,
                        atlas=atlas, placement=placement,
                        progress=_named(part.span(_READ, 1.0), frame))
            except UsageError:
                raise
            except Cancelled as error:
                more = f" ({error})" if str(error) else ""
                raise Cancelled(f"{index} of {len(frames)} frames are baked, --resume goes on with the others{more}") from None
            except BakeError as error:
                raise BakeError(f"frame {frame}: {error.cause}", error.remedy) from error
            entry = Keyframe(frame, bundle, state)
            known.setdefault(state, entry)
            entries = (*(series.frames if series else ()), entry)
            series = Series(folder, scene.name, technique, plain(asdict(settings)), seed, frames.start, frames[-1], frames.step,
                            frames_per_second(), entries)
            write_series(series)
    return SeriesSummary(series, baked, tuple(kept), tuple(shared))


def check_series_target(out, inputs=()) -> Path:
    """The absolute path of a series to be written to ``out`` while ``inputs`` are read. Raises BakeError for a path that will not
    do, and for a folder that holds a bundle or anything else but a series."""
    folder = check_output(out, replaced=True, inputs=inputs)
    if (folder / MANIFEST).is_file():
        raise BakeError(f"{folder} holds a bundle, and no series", "choose another --out, or move that folder away")
    if not is_series(folder):
        # Nothing, or an empty folder.
        check_target(folder, inputs=inputs)
    return folder


def _is_whole(bundle: Path) -> bool:
    try:
        read_manifest(bundle)
    except BakeError:
        return False
    return True


def _digest(parts: dict[str, str]) -> str:
    text = "\n".join(f"{name}={value}" for name, value in sorted(parts.items()))
    return hashlib.sha256(text.encode()).hexdigest()


def _named(progress: Progress, frame: int) -> Progress:
    """``progress`` with the frame before what it says."""
    return _Named(progress, f"Frame {frame}: ")


class _Named(Progress):
    def __init__(self, outer: Progress, prefix: str):
        super().__init__()
        self._parent, self._prefix = outer, prefix

    def step(self, fraction: float, label: str = "") -> None:
        """See Progress."""
        self._parent.step(fraction, self._prefix + label)

