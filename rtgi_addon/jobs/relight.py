"""A bundle with transfer under other light: ordinary bundles, from its files alone."""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..effects.atlas.matrices import AtlasTransfer
from ..effects.atlas.relight import relit_atlas
from ..effects.atlas.sheet import LightAtlas
from ..errors import UsageError
from ..exchange.bundle import Bundle, check_target, read_bundle, write_bundle
from ..exchange.names import folder_names
from ..exchange.plain import plain
from ..exchange.sky_image import read_sky
from ..progress import Progress
from ..scene import Scene, World
from ..storage.parse import Refused, listing, number, one_of, read_document, record, text
from ..storage.paths import check_output
from ..techniques.lattice.field import ProbeField
from ..techniques.transfer.field import TransferField
from ..techniques.transfer.lighting import Lighting, NewLamp, coarse, sky_of, sun_from, turned
from ..techniques.transfer.relight import below_horizon, relit
from ..words import as_lines

FRAMES_SCHEMA = "rtgi-frames/1"
# The shares of a job's progress that reading the bundle takes.
_READ_SHARE = 0.3


@dataclass(frozen=True)
class LightChange:
    """What light is to be, as a user says it; None or empty: as it was baked.

    ``world`` is the path of an image or (R, G, B); ``sky_turn`` in degrees about +Z, counterclockwise from above; ``suns`` are
    (azimuth, elevation, strength, R, G, B); ``groups`` (R, G, B) by name; ``lamps`` (x, y, z, watts).
    """

    world: str | tuple[float, ...] | None = None
    sky_turn: float | None = None
    suns: tuple[tuple[float, ...], ...] | None = None
    groups: dict[str, tuple[float, ...]] | None = None
    lamps: tuple[tuple[float, ...], ...] = ()

    def over(self, other: "LightChange") -> "LightChange":
        """This change, and of ``other`` what this leaves open."""
        return LightChange(self.world if self.world is not None else other.world,
                           self.sky_turn if self.sky_turn is not None else other.sky_turn,
                           self.suns if self.suns is not None else other.suns,
                           {**(other.groups or {}), **(self.groups or {})}, self.lamps or other.lamps)


@dataclass(frozen=True)
class RelightReport:
    """The bundles ``out`` that were written, of so many ``probes`` each, and the ``seconds`` that relighting itself took."""

    bundle: Path
    out: tuple[Path, ...]
    probes: int
    seconds: float
    notes: tuple[str, ...]

    def to_json(self) -> dict:
        """The values as JSON knows them."""
        return plain({"bundle": str(self.bundle), "out": [str(path) for path in self.out], "probes": self.probes,
                      "seconds": self.seconds, "notes": self.notes})

    def to_text(self) -> str:
        """The same as lines for a person."""
        what = f"{self.out[0]}" if len(self.out) == 1 else f"{len(self.out)} bundles in {self.out[0].parent}"
        each = 1000.0 * self.seconds / max(1, len(self.out))
        return as_lines([f"Relit {self.bundle} to {what}", f"  probes   {self.probes:,}, {each:.1f} ms each time",
                         *(f"  note     {note}" for note in self.notes)])


def relight_bundle(bundle, out, change: LightChange, frames=None, progress: Progress | None = None) -> RelightReport:
    """Relight the bundle at path ``bundle`` to ``out``; with ``frames``, a JSON file (docs/formats.md), to a bundle in ``out``
    for each of its frames, of which ``change`` holds what they leave open.

    Raises UsageError for a group that does not exist, BakeError for files that will not do, Cancelled; what was at ``out`` stays as
    it was until a new bundle is whole.
    """
    progress = progress or Progress()
    inputs = [bundle, *([] if frames is None else [frames])]
    if frames is None:
        changes, targets = [change], [check_target(out, inputs=inputs)]
    else:
        folder = check_output(out, inputs=inputs)
        named = read_frames(frames)
        names = folder_names([name for name, _ in named])
        changes, targets = [entry.over(change) for _, entry in named], [folder / name for name in names]
        folder.mkdir(exist_ok=True)
        targets = [check_target(target, inputs=inputs) for target in targets]
    progress.step(0.0, "Reading the bundle")
    content = read_bundle(bundle, progress)
    field = content.transfer_field
    lightings = [lighting_of(field, entry, Path(frames or ".").parent) for entry in changes]
    notes: dict[str, None] = {}
    if content.spheres is not None:
        notes["sphere probes are left out: they hold the light of the bake alone"] = None
    if content.atlas is not None:
        notes |= dict.fromkeys(_notes_on_atlas(content.atlas.transfer, lightings))
    seconds = 0.0
    for index, (target, entry, lighting) in enumerate(zip(targets, changes, lightings, strict=True)):
        progress.step(_READ_SHARE + (1.0 - _READ_SHARE) * index / len(targets), f"Relighting {target.name}")
        started = time.perf_counter()
        sky = None if lighting.world is None else sky_of(lighting.world, field.transfer)
        grids = relit(field.transfer, lighting, sky)
        seconds += time.perf_counter() - started
        if below_horizon(field.transfer, lighting):
            notes[f"{target.name}: a sun below the horizon gives nothing (bake with --set sun_below=true for that)"] = None
        atlas = None if content.atlas is None else relit_atlas(content.atlas, field.transfer, lighting)
        _write(target, content, field, grids, atlas, lighting, entry)
    return RelightReport(content.path, tuple(targets), sum(grid.validity.size for grid in content.grids), seconds, tuple(notes))


def lighting_of(field: TransferField, change: LightChange, folder: Path = Path()) -> Lighting:
    """``change`` as the transfer of ``field`` takes it; images lie relative to ``folder``."""
    world = None
    if isinstance(change.world, str):
        world = coarse(World(read_sky(folder / change.world), description=change.world))
    elif change.world is not None:
        world = World.constant(change.world)
    if change.sky_turn is not None:
        world = turned(field.transfer.world if world is None else world, change.sky_turn)
    suns = None if change.suns is None else tuple(
        sun_from(azimuth, elevation, strength * np.array(color or (1.0, 1.0, 1.0)))
        for azimuth, elevation, strength, *color in change.suns)
    groups = {name: np.broadcast_to(np.asarray(factor, np.float64), (3,)) for name, factor in (change.groups or {}).items()}
    lamps = tuple(NewLamp(np.array(lamp[:3]), np.full(3, lamp[3])) for lamp in change.lamps)
    return Lighting(world, suns, groups, lamps)


_COLOUR = listing(number(0.0, 1e12), 3)
_FRAME = record({"name": text}, {
    "world": lambda value, where: text(value, where) if isinstance(value, str) else _COLOUR(value, where),
    "sky_turn": number(-1e6, 1e6), "suns": listing(listing(number(-1e12, 1e12))), "lamps": listing(listing(number(-1e12, 1e12), 4)),
    "groups": lambda value, where: _groups(value, where)})
_FRAMES = record({"schema": one_of(FRAMES_SCHEMA), "frames": listing(_FRAME)})


def read_frames(path) -> list[tuple[str, LightChange]]:
    """The frames of the file at ``path`` by name. Raises BakeError naming what in it is wrong."""
    document = read_document(path, FRAMES_SCHEMA, _check_frames, "correct the file")
    result = []
    for frame in document["frames"]:
        world = frame.get("world")
        suns = frame.get("suns")
        result.append((frame["name"], LightChange(
            tuple(world) if isinstance(world, list) else world, frame.get("sky_turn"),
            None if suns is None else tuple(map(tuple, suns)),
            {name: tuple(factor) if isinstance(factor, list) else (factor,) * 3
             for name, factor in frame.get("groups", {}).items()},
            tuple(map(tuple, frame.get("lamps", []))))))
    return result


def _check_frames(document: dict, where: str) -> None:
    _FRAMES(document, where)
    if not document["frames"]:
        raise Refused("it has no frames")
    for index, frame in enumerate(document["frames"]):
        for sun in frame.get("suns", []):
            if len(sun) not in (3, 6):
                raise Refused(f"frames[{index}].suns has {len(sun)} numbers, not azimuth, elevation, strength and perhaps R, G, B")


def _groups(value, where: str) -> None:
    if not isinstance(value, dict):
        raise Refused(f"{where} is no object")
    for name, factor in value.items():
        (_COLOUR if isinstance(factor, list) else number(0.0, 1e12))(factor, f"{where}[{name!r}]")


def _notes_on_atlas(transfer: AtlasTransfer | None, lightings: list[Lighting]) -> list[str]:
    """What a light atlas with that ``transfer`` (None: none) does not follow of ``lightings``."""
    if transfer is None:
        return ["the light atlas is left out: it holds the light of the bake alone"]
    notes = []
    if not transfer.follows_suns and any(lighting.suns for lighting in lightings):
        notes.append("the light atlas follows no suns: bake it with --set atlas.suns=8")
    if any(lighting.lamps for lighting in lightings):
        notes.append("the light atlas does not follow new lamps: give them a group in the file, dimmed to nothing")
    return notes


def _write(target: Path, content: Bundle, field: TransferField, grids, atlas: LightAtlas | None, lighting: Lighting,
           change: LightChange) -> None:
    manifest, suns = content.manifest, {name for name, kind in field.transfer.lights if kind == "suns"}
    probes = ProbeField(grids, direct_lamps=field.direct_lamps)
    probes.technique, probes.atlas = manifest["technique"], atlas
    lamps = {} if suns and lighting.suns is not None else manifest.get("lamps", {})
    said = ", ".join(_said(change)) or "the light it was baked with"
    # Media stay those of the bake: transfer knows none of them.
    scene = Scene(manifest["scene"], blender_version=manifest["blender"], media=content.media)
    write_bundle(target, probes, scene, settings=manifest["settings"],
                 seed=manifest["seed"], roles=(lamps, manifest.get("objects", {})),
                 stats=lambda: {"relit": plain(_as_json(change)), "rays": 0, "seconds": {}},
                 notes=[f"relit from {content.path.name}: {said}", *manifest.get("notes", [])],
                 not_followed=manifest.get("not_followed", []))


def _as_json(change: LightChange) -> dict:
    return {"world": change.world, "sky_turn": change.sky_turn, "suns": change.suns, "groups": change.groups, "lamps": change.lamps}


def _said(change: LightChange) -> list[str]:
    parts = [] if change.world is None else [f"world {change.world if isinstance(change.world, str) else _numbers(change.world)}"]
    parts += [] if change.sky_turn is None else [f"sky turned by {change.sky_turn:g}°"]
    parts += [f"sun {_numbers(sun)}" for sun in change.suns or ()]
    parts += ["no sun"] if change.suns == () else []
    parts += [f"group {name} × {_numbers(factor)}" for name, factor in (change.groups or {}).items()]
    return parts + [f"lamp {_numbers(lamp)}" for lamp in change.lamps]


def _numbers(values) -> str:
    return ",".join(f"{value:g}" for value in values)


def parse_numbers(words: str, counts: tuple[int, ...], what: str) -> tuple[float, ...]:
    """The numbers in ``words``, separated by commas, as many as one of ``counts``. Raises UsageError, which calls them ``what``."""
    try:
        values = tuple(float(word) for word in words.split(","))
    except ValueError:
        raise UsageError(f"{words!r} is not {what}", "give numbers separated by commas") from None
    if len(values) not in counts or not np.isfinite(values).all():
        raise UsageError(f"{words!r} is not {what}", "give numbers separated by commas")
    return values


def require_at_least_zero(values, words: str, what: str) -> None:
    """Raises UsageError for a negative one of ``values``, which were given as ``words`` for ``what``."""
    if min(values) < 0:
        raise UsageError(f"{words!r} is not {what}", "light is not negative")

