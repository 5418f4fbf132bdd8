"""A bake from what was prepared: all of it to a bundle, or one part of it, and the parts to a bundle. No Blender, no file."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import techniques
from ..effects.spheres.bake import bake_spheres
from ..effects.spheres.settings import SPHERES
from ..errors import BakeError
from ..evaluate.concerns import Concern
from ..exchange.array_folder import ArrayFolder, check_folder_target, write_folder
from ..exchange.bundle import check_target, replaceable, write_bundle
from ..exchange.plain import plain
from ..exchange.prepared import (
    ABOUT,
    BLOCKS,
    COMMON,
    PART,
    SCENE,
    TRUTH,
    kernels_here,
    read_part,
    read_prepared,
    scene_of,
    told,
)
from ..machine.memory import peak_memory_bytes
from ..progress import Progress
from ..scene import Omission, Scene
from ..scene.encoding import encode
from ..storage.array_file import let_go
from ..storage.workplace import Workplace, workplace
from ..techniques.base import BakeBlocks
from ..transport.cache.checkpoint import labelled, part_of
from ..transport.rays.choose import slow_rays_warning
from ..words import as_lines
from .belonging import about_scene
from .checkpoint import FileCheckpoint
from .report import BakeSummary, lattice_warning, summarize
from .settings import build_settings

# How far a bake is when its blocks are made.
_MADE = 0.97


@dataclass(frozen=True)
class PartSummary:
    """A finished part: ``part`` of ``parts``, with ``blocks`` of the bake's blocks."""

    out: Path
    part: int
    parts: int
    blocks: int
    rays: int
    seconds: dict[str, float]
    peak_memory_bytes: int
    resumed: bool
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict:
        """The summary as JSON-able values."""
        return plain({**asdict(self), "out": str(self.out)})

    def to_text(self) -> str:
        """The summary as lines for a person."""
        return as_lines([
            f"Baked {self.out}, part {self.part} of {self.parts}: {self.blocks:,} blocks" + (" (resumed)" if self.resumed else ""),
            f"  rays     {self.rays:,}",
            f"  seconds  {sum(self.seconds.values()):.2f}",
            f"  memory   {self.peak_memory_bytes / 2**20:,.0f} MiB at most",
            *(f"  warning  {warning}" for warning in self.warnings)])


def blocks_of(part: int, parts: int, blocks: int) -> range:
    """The blocks of ``part`` (from 1 on) of ``parts``: neighbours, and as many as of the other parts or one more."""
    return range((part - 1) * blocks // parts, part * blocks // parts)


class Ready(NamedTuple):
    """A prepared bake that was read, and what its blocks are made with: what a process that makes several parts reads once."""

    folder: ArrayFolder
    blocks: BakeBlocks

    @classmethod
    def of(cls, folder: ArrayFolder, threads: int | None = None) -> "Ready":
        """The one in the ``folder`` that was read. Raises BakeError."""
        method, settings = _technique(folder)
        return cls(folder, method.blocks.begin(scene_of(folder), settings, np.random.default_rng(folder.document["seed"]),
                                               folder.arrays[COMMON], threads))


def bake_prepared(prepared, out, *, part: tuple[int, int] | None = None, threads: int | None = None,
                  progress: Progress | None = None, resume: bool = False, checkpoint_seconds: float = 10.0,
                  ready: Ready | None = None) -> BakeSummary | PartSummary:
    """Bake what was prepared in the folder ``prepared`` into the bundle ``out``, or the ``part`` (K, N) of it into a part's folder.

    All parts, merged, are the very bytes of the whole. A checkpoint is left in `OUT.partial` at most every ``checkpoint_seconds``.
    ``ready`` is what an earlier part of the same bake was made with; after anything was raised it serves no more.
    Raises BakeError, and Cancelled once ``progress.cancel`` was called; what was at ``out`` before is then as it was.
    """
    progress = progress or Progress()
    inputs = (str(prepared),)
    target = check_target(out, inputs=inputs) if part is None else check_folder_target(PART, out, inputs=inputs)
    progress.stage("read")
    progress.step(0.0, "Reading what was prepared")
    folder = read_prepared(prepared) if ready is None else ready.folder
    document = folder.document
    number, parts = part or (1, 1)
    method, settings = _technique(folder)
    slow = slow_rays_warning()
    warnings = (slow,) if slow else ()
    wanted = blocks_of(number, parts, document["blocks"])
    with workplace(target, "bake") as place:
        run = {"prepared bake": folder.digest, "part": f"{number}/{parts}"}
        checkpoint = FileCheckpoint(place, run, resume=resume, interval=checkpoint_seconds)
        made = _make(lambda: (ready or Ready.of(folder, threads)).blocks, wanted, progress.span(0.0, _MADE), checkpoint)
        progress.stage("write")
        progress.step(_MADE, f"Writing {target.name}")
        if part is None:
            summary = _write_bundle(place, folder, method, settings, lambda index, name: made[index][name], progress,
                                    checkpoint.resumed, warnings, threads)
            checkpoint.parts.remove()
            return summary
        rays = int(sum(int(block["rays"][0]) for block in made.values()))
        scene = scene_of(folder)
        # Sphere probes look at all of the scene, once everything else stands: one part takes it along.
        along = number == 1 and bool(_wanted_spheres(folder.document, scene).spheres)
        scene, about = encode(scene) if along else told(scene)
        seconds = progress.finish()
        write_folder(PART, place, plain({
            **{name: document[name] for name in ("rtgi", "numpy", "technique", "settings", "seed", "blocks", "said", "spheres")},
            "scene": scene, "prepared": folder.digest, "part": number, "parts": parts, "kernels": kernels_here(),
            "made": list(wanted),
            "stats": {"rays": rays, "seconds": seconds, "peak_memory_bytes": peak_memory_bytes()}}),
            {SCENE if along else ABOUT: about, TRUTH: folder.arrays.get(TRUTH, {}),
             BLOCKS: {name: array for index in wanted for name, array in labelled(f"{index}", made[index]).items()}})
        checkpoint.parts.remove()
    return PartSummary(target, number, parts, len(wanted), rays, seconds, peak_memory_bytes(), checkpoint.resumed, warnings)


def merge_parts(paths: Iterable, out, *, progress: Progress | None = None) -> BakeSummary:
    """Write the bundle of all parts of one bake, in the folders ``paths``, to ``out``: the very bytes of a bake that was never
    cut. Raises BakeError for parts that do not belong together, one that is missing, there twice or damaged; ``out`` is then as it
    was."""
    progress = progress or Progress()
    paths = [Path(path) for path in paths]
    target = check_target(out, inputs=tuple(map(str, paths)))
    progress.stage("read")
    folders = []
    for number, path in enumerate(paths):
        progress.step(0.5 * number / len(paths), f"Reading {path.name}")
        folders.append(read_part(path))
    require_whole(folders)
    method, settings = _technique(folders[0])
    with workplace(target, "merge") as place:
        replaceable(place.path)
        progress.stage("write")
        progress.step(0.5, f"Writing {target.name}")
        telling = next((folder for folder in folders if SCENE in folder.arrays), folders[0])
        return _write_bundle(place, telling, method, settings, _reader(folders), progress, False, ())


def require_whole(folders: list[ArrayFolder]) -> None:
    """Raise BakeError unless ``folders`` are all parts of one bake, each once."""
    if not folders:
        raise BakeError("there is nothing to merge", "name the folders of all parts")
    first, seen = folders[0], {}
    for folder in folders:
        document = folder.document
        if document["prepared"] != first.document["prepared"]:
            raise BakeError(f"{folder.path} is of another prepared bake than {first.path}", "merge parts of one bake alone")
        if document["parts"] != first.document["parts"]:
            raise BakeError(f"{folder.path} is one of {document['parts']} parts, and {first.path} one of {first.document['parts']}",
                            "cut the bake into as many everywhere")
        if document["kernels"] != first.document["kernels"]:
            raise BakeError(f"{folder.path} was made with kernels {document['kernels']}, and {first.path} with "
                            f"{first.document['kernels']}: their bytes differ by rounding", "make all parts with the same kernels")
        expected = blocks_of(document["part"], document["parts"], document["blocks"])
        if not 1 <= document["part"] <= document["parts"] or document["made"] != list(expected):
            raise BakeError(f"{folder.path} is damaged, its blocks are not those of part {document['part']}", PART.remedy)
        if document["part"] in seen:
            raise BakeError(f"{folder.path} and {seen[document['part']]} are both part {document['part']}", "leave one of them out")
        seen[document["part"]] = folder.path
    missing = [number for number in range(1, first.document["parts"] + 1) if number not in seen]
    if missing:
        some = ", ".join(map(str, missing[:12])) + (f" and {len(missing) - 12} more" if len(missing) > 12 else "")
        raise BakeError(f"of {first.document['parts']} parts these are missing: {some}",
                        "bake what is missing, and name the folders of all parts")


def _technique(folder: ArrayFolder) -> tuple[techniques.Technique, object]:
    method = techniques.get(folder.document["technique"])
    if method.blocks is None:
        raise BakeError(f"{folder.path} is damaged, a bake of {method.name} has no parts", PART.remedy)
    return method, build_settings(method, folder.document["settings"])


def _make(blocks: Callable[[], BakeBlocks], wanted: range, progress: Progress,
          checkpoint: FileCheckpoint) -> dict[int, Mapping[str, np.ndarray]]:
    """The blocks ``wanted``, those of an interrupted run among them."""
    made: dict[int, Mapping[str, np.ndarray]] = {}
    saves = 0
    while (kept := checkpoint.load(f"blocks-{saves}")) is not None:
        for index in sorted({int(name.partition(".")[0]) for name in kept}):
            made[index] = part_of(kept, f"{index}")
        saves += 1
    left = [index for index in wanted if index not in made]
    if not left:
        return made
    progress.stage("blocks")
    progress.step(0.0, "building the ray tracer")
    bake = blocks()
    fresh: dict[str, np.ndarray] = {}
    for number, index in enumerate(left):
        made[index] = bake.bake(index, progress.span((len(made)) / len(wanted), (len(made) + 1) / len(wanted)))
        fresh |= labelled(f"{index}", made[index])
        if checkpoint.due and number + 1 < len(left):
            checkpoint.save(f"blocks-{saves}", fresh)
            saves, fresh = saves + 1, {}
    return made


def _reader(folders: list[ArrayFolder]) -> Callable[[int, str], np.ndarray]:
    """``read(block, name)`` of the arrays in ``folders``; no more than one folder's lie in memory."""
    holder = {index: folder for folder in folders for index in folder.document["made"]}
    last = folders[0]

    def read(index: int, name: str) -> np.ndarray:
        nonlocal last
        folder = holder[index]
        if folder is not last:
            let_go(last.arrays.get(BLOCKS, {}))
            last = folder
        array = folder.arrays.get(BLOCKS, {}).get(f"{index}.{name}")
        if array is None:
            raise BakeError(f"{folder.path} is damaged, {name} of block {index} is not in it", PART.remedy)
        return array

    return read


def _write_bundle(place: Workplace, folder: ArrayFolder, method, settings, read, progress: Progress, resumed: bool,
                  warnings, threads: int | None = None) -> BakeSummary:
    """The bundle of all blocks, of which ``read(block, name)`` gives the arrays, of the bake that ``folder`` (prepared, or a part)
    tells about."""
    document, scene = folder.document, scene_of(folder)
    said = document["said"]
    try:
        field = method.blocks.field(scene.volumes, settings, read, frozenset(said["direct_lamps"]), folder.arrays.get(TRUTH, {}))
    except (IndexError, TypeError, ValueError) as error:
        raise _other_form(folder, error) from error
    scene = _wanted_spheres(document, scene)
    if scene.spheres:
        progress.stage("spheres")
    mirrors = bake_spheres(scene, field, build_settings(SPHERES, document["spheres"]), document["seed"], threads,
                           progress.span(_MADE, 1.0))
    field.spheres = mirrors.probes
    coarse = lattice_warning(field)
    found = (*mirrors.notes, *((coarse,) if coarse else ()))
    warnings = (*said["warnings"], *found, *warnings)

    def stats() -> dict:
        return {**field.stats, "seconds": progress.finish(), "peak_memory_bytes": peak_memory_bytes(),
                **about_scene(scene, field, ""), **({"sphere_rays": mirrors.rays} if mirrors.rays else {})}

    try:
        write_bundle(place, field, scene, settings=asdict(settings), seed=document["seed"],
                     notes=[*said["notes"], *said["warnings"], *found], not_followed=said["not_followed"], stats=stats,
                     roles=(said["lamps"], said["objects"]))
    except (IndexError, ValueError) as error:
        raise _other_form(folder, error) from error
    not_followed = tuple(Concern(Omission(entry["text"], tuple(entry["objects"]), tuple(entry["materials"])), entry["share"],
                                 entry["how"]) for entry in said["not_followed"])
    summary = summarize(field, scene, out=place.path, technique=document["technique"], settings=asdict(settings),
                        seed=document["seed"], warnings=warnings, resumed=resumed, stats=stats(), not_followed=not_followed)
    return replace(summary, lamps=said["lamps"], objects=said["objects"], notes=tuple(said["notes"]))


def _wanted_spheres(document: dict, scene: Scene) -> Scene:
    """``scene`` with those of its sphere probes that are to be baked."""
    return scene if build_settings(SPHERES, document["spheres"]).bake else replace(scene, spheres=())


def _other_form(folder: ArrayFolder, error: Exception) -> BakeError:
    return BakeError(f"{folder.path} or a part of the same bake is damaged, its blocks have another form: {error}", PART.remedy)
