"""The bake bundle (FORMATS.md): write it whole or not at all, check it, read it back.

The same bake gives the same bytes in every file; what differs from run to run (seconds, memory) is confined to `stats` in
`bake.json`.
"""

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..scene import ProbeVolume, Scene
from ..techniques import Field, ProbeGrid
from ..techniques.lpv.field import LpvField
from ..techniques.probes.field import ProbeField
from . import flipbook
from .exr import read_exr, write_exr
from .files import disk_error, recover_swap, remove_folder, sibling, swap_folder, sync_file, sync_folder, write_atomically
from .lpv_volume import FOLDER as LPV_FOLDER
from .lpv_volume import INDEX as LPV_INDEX
from .lpv_volume import write_lpv_volume
from .names import folder_names
from .plain import plain
from .schema import MANIFEST, RESTORE, RTGI_VERSION, SAMPLE_PLACEMENT, SCHEMA, SH_CONVENTION, files_of, read_manifest

# Left by file browsers in any folder they show; no reason to refuse replacing a bundle.
_BYSTANDERS = {".DS_Store", "Thumbs.db", "desktop.ini"}


@dataclass(frozen=True, eq=False)
class Bundle:
    """A bundle read back: ``manifest`` is the checked `bake.json`, ``grids`` the volumes in its order."""

    path: Path
    manifest: dict
    grids: tuple[ProbeGrid, ...]

    @property
    def field(self) -> ProbeField:
        """The probes as a field, whichever technique they were sampled from: what an engine that reads the bundle shows."""
        return ProbeField(self.grids, includes_direct=bool(self.manifest.get("includes_direct")))


def check_target(out) -> Path:
    """The absolute path of a bundle to be written to ``out``, after a swap that was interrupted is mended.

    Raises BakeError if the parent folder is missing, or if ``out`` exists and holds anything but a bundle.
    """
    path = Path(out).expanduser().resolve()
    if not path.parent.is_dir():
        raise BakeError(f"the folder {path.parent} does not exist", "create it first, or choose another --out")
    try:
        recover_swap(path)
        if path.exists() and not path.is_dir():
            raise BakeError(f"{path} is a file", "choose a folder as --out")
        stranger = _stranger(path) if path.is_dir() else None
    except OSError as error:
        raise disk_error(path, error) from error
    if stranger is not None:
        raise BakeError(f"{path} holds {stranger}, which is not part of a bundle",
                        "choose another --out, or move that away: the whole folder is replaced")
    return path


def _stranger(folder: Path) -> str | None:
    """The first thing in ``folder`` that no bundle of ours put there, or None."""
    if not (folder / MANIFEST).is_file():
        return next((item.name for item in folder.iterdir() if item.name not in _BYSTANDERS), None)
    try:
        ours = {MANIFEST, *read_manifest(folder)["sha256"]}
    except BakeError as error:
        raise BakeError(f"{folder} would be replaced and is no bundle this version can read, {error.cause}",
                        "choose another --out, or remove that folder") from error
    files = (item for item in folder.rglob("*") if not item.is_dir() and item.name not in _BYSTANDERS)
    return next((name for name in (item.relative_to(folder).as_posix() for item in files) if name not in ours), None)


def write_bundle(out, field: Field, scene: Scene, *, settings: dict, seed: int, stats: Callable[[], dict],
                 notes=()) -> Path:
    """Write the grids of ``field`` as the bundle ``out`` and return its path.

    ``stats`` is called last, so that it can hold the seconds of this very writing.
    Everything is written and flushed to a folder beside ``out`` first, which then takes its place in one step: whatever
    happens before leaves an earlier bundle as it was. Raises BakeError for a disk that refuses and for values that are not
    finite.
    """
    path = check_target(out)
    new = sibling(path, "rtgi-new")
    try:
        remove_folder(new)
        new.mkdir()
        _write_files(new, field, scene, settings, seed, stats, notes)
        swap_folder(new, path)
    except OSError as error:
        raise disk_error(path, error) from error
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return path


def _write_files(folder: Path, field: Field, scene: Scene, settings: dict, seed: int, stats, notes) -> None:
    grids = field.grids()
    reserved = [MANIFEST, LPV_FOLDER] if isinstance(field, LpvField) else [MANIFEST]
    folders = folder_names([grid.volume.name for grid in grids], reserved=reserved)
    volumes = [_write_volume(folder, name, grid) for name, grid in zip(folders, grids, strict=True)]
    digests = {name: _sha256(folder / name) for volume in volumes for name in files_of(volume)}
    more = {}
    if isinstance(field, LpvField):
        digests |= {name: _sha256(folder / name) for name in write_lpv_volume(folder, field)}
        more["lpv"] = LPV_INDEX
    for name in folders:
        sync_folder(folder / name)
    manifest = {
        "schema": SCHEMA,
        "scene": scene.name,
        "blender": scene.blender_version,
        "rtgi": RTGI_VERSION,
        "technique": field.technique,
        "settings": plain(settings),
        "seed": seed,
        "includes_direct": bool(field.includes_direct),
        "sh_convention": SH_CONVENTION,
        "volumes": volumes,
        **more,
        "notes": list(notes),
        "sha256": digests,
        "stats": plain(stats()),
    }
    write_atomically(folder / MANIFEST, (json.dumps(manifest, indent=1, allow_nan=False) + "\n").encode())
    sync_folder(folder)


def _write_volume(bundle: Path, folder: str, grid: ProbeGrid) -> dict:
    """Write one volume's images into ``bundle``/``folder`` and return its entry for the manifest."""
    volume = grid.volume
    _require_finite(grid)
    (bundle / folder).mkdir()
    resolution = [int(n) for n in volume.resolution]
    cell = grid.visibility.shape[3]
    tiles, visibility_tiles = flipbook.layout(resolution), flipbook.layout(resolution, cell)
    entry = {
        "name": volume.name,
        "resolution": resolution,
        "world_from_local": np.asarray(volume.world_from_local, np.float64).tolist(),
        "sample_placement": SAMPLE_PLACEMENT,
        "fitted": bool(volume.fitted),
        "sh_order": grid.order,
        "tiles": tiles._asdict(),
        "sh": [f"{folder}/sh{index}.exr" for index in range(grid.sh.shape[3])],
        "visibility": f"{folder}/visibility.exr",
        "visibility_size": cell,
        "visibility_tiles": visibility_tiles._asdict(),
        "validity": f"{folder}/validity.exr",
    }
    alone = {"schema": SCHEMA, "volume": volume.name, "sh_convention": SH_CONVENTION,
             **{key: entry[key] for key in ("resolution", "world_from_local", "sample_placement", "sh_order", "tiles")}}

    def write(name: str, kind: str, names: str, sheet: np.ndarray, **more) -> None:
        write_exr(bundle / name, {letter: sheet[..., index] for index, letter in enumerate(names)},
                  {**alone, "kind": kind, **more})
        sync_file(bundle / name)

    for index, name in enumerate(entry["sh"]):
        write(name, "sh", "RGB", flipbook.to_sheet(grid.sh[:, :, :, index], tiles), coefficient=index)
    write(entry["visibility"], "visibility", "RG", flipbook.octahedral_to_sheet(grid.visibility, visibility_tiles),
          tiles=entry["visibility_tiles"], visibility_size=cell)
    write(entry["validity"], "validity", "Y", flipbook.to_sheet(grid.validity[..., None], tiles))
    if np.any(grid.offset_world != 0):
        entry["offset"] = f"{folder}/offset.exr"
        write(entry["offset"], "offset", "RGB", flipbook.to_sheet(grid.offset_world, tiles))
    if not np.all(np.isnan(grid.standard_error)):
        entry["standard_error"] = f"{folder}/standard_error.exr"
        write(entry["standard_error"], "standard_error", "Y", flipbook.to_sheet(grid.standard_error[..., None], tiles))
    return entry


def _require_finite(grid: ProbeGrid) -> None:
    for kind in ("sh", "visibility", "validity", "offset_world"):
        values = getattr(grid, kind)
        bad = ~np.isfinite(values).reshape(*values.shape[:3], -1).all(axis=-1)
        if bad.any():
            first = tuple(int(index) for index in np.argwhere(bad)[0][::-1])
            raise BakeError(f"volume {grid.volume.name!r}: {kind} is not finite at {int(bad.sum())} probes, first at {first}",
                            "look for infinite light strengths in the scene, and report this with the file")


def check_bundle(path) -> dict:
    """The manifest of the bundle at ``path`` after every file's checksum was compared. Raises BakeError naming the first file
    that is missing or differs."""
    path = _located(path)
    manifest = read_manifest(path)
    for name, digest in manifest["sha256"].items():
        file = path / name
        if not file.is_file():
            raise BakeError(f"{file} is missing", RESTORE)
        try:
            found = _sha256(file)
        except OSError as error:
            raise disk_error(file, error, doing="read") from error
        if found != digest:
            raise BakeError(f"{file} is cut short or damaged, its checksum is not the one in {MANIFEST}", RESTORE)
    return manifest


def read_bundle(path) -> Bundle:
    """Check and read the bundle at ``path``. Raises BakeError naming the file for anything missing, damaged, of another size
    than `bake.json` says, or not finite."""
    path = _located(path)
    manifest = check_bundle(path)
    return Bundle(path, manifest, tuple(_read_volume(path, entry) for entry in manifest["volumes"]))


def _located(path) -> Path:
    path = Path(path).expanduser().resolve()
    try:
        recover_swap(path)
    except OSError as error:
        raise disk_error(path, error, doing="recover") from error
    return path


def _read_volume(bundle: Path, entry: dict) -> ProbeGrid:
    resolution, cell = tuple(entry["resolution"]), entry["visibility_size"]
    tiles, visibility_tiles = (flipbook.Tiles(entry[key]["columns"], entry[key]["rows"]) for key in ("tiles", "visibility_tiles"))

    def read(name: str, names: str, unfold, finite: bool = True) -> np.ndarray:
        planes, _ = read_exr(bundle / name)
        if set(planes) != set(names):
            raise BakeError(f"{bundle / name} has channels {', '.join(sorted(planes))} instead of {', '.join(names)}", RESTORE)
        sheet = np.stack([planes[letter] for letter in names], axis=-1, dtype=np.float32)
        if finite and not np.isfinite(sheet).all():
            raise BakeError(f"{bundle / name} holds values that are not finite", RESTORE)
        try:
            return unfold(sheet)
        except ValueError as error:
            raise BakeError(f"{bundle / name} has the wrong size, {error}", RESTORE) from error

    def lattice(sheet: np.ndarray) -> np.ndarray:
        return flipbook.from_sheet(sheet, resolution, tiles)

    validity = read(entry["validity"], "Y", lattice)[..., 0]
    offset, error = np.zeros((*validity.shape, 3), np.float32), np.full(validity.shape, np.nan, np.float32)
    if "offset" in entry:
        offset = read(entry["offset"], "RGB", lattice)
    if "standard_error" in entry:
        error = read(entry["standard_error"], "Y", lattice, finite=False)[..., 0]
    return ProbeGrid(
        volume=ProbeVolume(entry["name"], np.array(entry["world_from_local"], np.float64), resolution, bool(entry.get("fitted"))),
        sh=np.stack([read(name, "RGB", lattice) for name in entry["sh"]], axis=3),
        validity=validity,
        visibility=read(entry["visibility"], "RG",
                        lambda sheet: flipbook.octahedral_from_sheet(sheet, resolution, cell, visibility_tiles)),
        offset_world=offset,
        standard_error=error,
    )


def _sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
