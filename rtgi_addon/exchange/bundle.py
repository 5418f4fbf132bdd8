"""The bake bundle (docs/formats.md): write it whole or not at all, check it, read it back.

The same bake gives the same bytes in every file; what differs from run to run (seconds, memory, and with them the checksum of
`bake.json`) is confined to `stats` in it.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..effects.atlas.sheet import LightAtlas
from ..effects.spheres.maps import SphereProbes
from ..errors import BakeError
from ..machine.memory import available_bytes
from ..progress import Progress
from ..scene import Medium, ProbeVolume, Scene
from ..scene.scattered import named, of_grid
from ..storage.files import disk_error
from ..storage.owned import owned
from ..storage.parse import require_inside
from ..storage.paths import check_output, resolved
from ..storage.reading import open_file, read_file, sha256_of_file
from ..storage.workplace import Workplace, replaced_of, workplace
from ..storage.writing import write_file
from ..techniques import Field, ProbeGrid
from ..techniques.lattice.field import ProbeField
from ..techniques.transfer.field import TransferField
from ..techniques.voxels.shipped import ShippedVoxels
from . import flipbook
from .atlas_files import read_atlas
from .bundle_media import read_media
from .bundle_parts import parts_of
from .bundle_volume import write_volume
from .exr import decode_exr, largest_file, require_image
from .names import folder_names
from .plain import plain
from .roles import direct_lamps, lamp_roles, object_roles
from .schema import (
    CHECKSUM,
    FITTED,
    MANIFEST,
    NO_CHECKSUM,
    RESTORE,
    RTGI_VERSION,
    SCHEMA,
    SH_CONVENTION,
    files_of,
    image_header,
    manifest_bytes,
    read_manifest,
    volume_bytes,
)
from .sphere_files import read_spheres
from .transfer_files import read_transfer
from .voxel_files import read_voxels

_Read = TypeVar("_Read")


@dataclass(frozen=True, eq=False)
class Bundle:
    """A bundle read back: ``manifest`` is the checked `bake.json`, ``grids`` the volumes in its order, ``media`` what fills space
    between surfaces, everywhere or on grids, ``spheres`` what sphere probes saw, ``atlas`` light at the texels of UV maps,
    ``voxels`` the scene as lit voxels."""

    path: Path
    manifest: dict
    grids: tuple[ProbeGrid, ...]
    media: tuple[Medium, ...] = ()
    spheres: SphereProbes | None = None
    atlas: LightAtlas | None = None
    voxels: ShippedVoxels | None = None

    @property
    def unchecked(self) -> tuple[str, ...]:
        """What reading it could not make sure of, as notes for the user."""
        return () if CHECKSUM in self.manifest["stats"] else (NO_CHECKSUM,)

    @property
    def field(self) -> ProbeField:
        """The probes as a field, whichever technique they were sampled from: what an engine that reads the bundle shows."""
        return self._with_others(ProbeField(self.grids, direct_lamps=direct_lamps(self.manifest)))

    @property
    def transfer_field(self) -> TransferField:
        """The probes with what they make of any light, read from the disk now. Raises BakeError for a bundle without transfer, and
        for files that are missing or damaged."""
        if "transfer" not in self.manifest:
            relit = "relit" in self.manifest["stats"]
            if relit:
                raise BakeError(f"{self.path} holds no transfer, it was relit", "give the bundle that it was relit from")
            raise BakeError(f"{self.path} holds no transfer, it was baked with {self.manifest['technique']}",
                            "bake it with --technique transfer")
        return self._with_others(TransferField(read_transfer(self.path, self.grids), direct_lamps=direct_lamps(self.manifest),
                                                params=self.manifest["settings"]))

    def _with_others(self, field: Field) -> Field:
        field.spheres, field.atlas = self.spheres, self.atlas
        return field


def check_target(out, *, inputs=(), others=(), size: int = 0) -> Path:
    """The absolute path of a bundle of at least ``size`` bytes to be written to ``out``, while ``inputs`` are read and beside the
    ``others`` of the same run.

    Raises BakeError for a path that will not do (``check_output``), and if ``out`` holds anything but a bundle as it was written.
    """
    path = check_output(out, replaced=True, inputs=inputs, others=others, size=size)
    replaceable(path)
    return path


def least_bytes(volumes, order: int, cell: int) -> int:
    """The bytes that a bundle of ``volumes`` takes at least: probes of SH order ``order`` with visibility maps of ``cell`` texels a
    side. Compressed, that is: light that is the same everywhere takes a tenth of its numbers, any other more."""
    probes = sum(int(np.prod(volume.resolution, dtype=np.int64)) for volume in volumes)
    return 4 * probes * (3 * (order + 1) ** 2 + 2 * cell**2 + 1) // 10


def replaceable(path: Path, contents: bool = True) -> dict[str, str]:
    """What of the folder ``path`` is a bundle's (name → checksum), which must be all of it; ``contents`` also compares checksums.

    Raises BakeError for anything that is not of a bundle, that was changed since it was written, or that cannot be read.
    """
    return owned(path, MANIFEST, lambda: _manifest_to_replace(path)["sha256"], "a bundle", contents)


def _manifest_to_replace(path: Path) -> dict:
    try:
        return read_manifest(path)
    except BakeError as error:
        raise BakeError(f"{path} would be replaced and is no bundle this version can read, {error.cause}",
                        "choose another --out, or remove that folder") from error


def write_bundle(out, field: Field, scene: Scene, *, settings: dict, seed: int, stats: Callable[[], dict],
                 notes=(), not_followed=(), roles: tuple[dict, dict] | None = None) -> Path:
    """Write the grids of ``field`` as the bundle ``out`` (a path, or its Workplace) and return its path.

    ``roles`` (None: those of ``scene``) are those of lamps and of objects, where the scene itself is not known.
    ``notes`` are lines for people, ``not_followed`` JSON-able entries about what the file holds and the bake does not follow;
    ``stats`` is called last, so that it can hold the seconds of this very writing.
    Everything is written and flushed to a folder beside ``out`` first, which then takes its place in one step: whatever
    happens before leaves an earlier bundle as it was. Raises BakeError for a disk that refuses and for values that are not
    finite.
    """
    path = out if isinstance(out, Workplace) else check_target(out)
    with workplace(path, "bake") as place:
        try:
            _write_files(place.new, field, scene, settings, seed, stats, notes, not_followed, roles)
            stranger = place.put_folder(replaceable(place.path, contents=False))
        except OSError as error:
            raise disk_error(place.path, error) from error
    if stranger is not None:
        raise BakeError(f"{place.path} was replaced while somebody put {stranger.name} there",
                        f"the new bundle is whole; take what you need of {place.folder}, and remove that")
    return place.path


def _write_files(folder: Path, field: Field, scene: Scene, settings: dict, seed: int, stats, notes, not_followed,
                 roles) -> None:
    grids = field.grids()
    parts = parts_of(field, scene)
    reserved = [MANIFEST, *(part.folder for part in parts)]
    folders = folder_names([grid.volume.name for grid in grids], reserved=reserved)
    volumes = [write_volume(folder, name, grid) for name, grid in zip(folders, grids, strict=True)]
    files = [name for volume in volumes for name in files_of(volume)]
    lamps, objects = roles or (lamp_roles(scene, field), object_roles(scene))
    for part in parts:
        files += part.write(folder)
    manifest = {
        "schema": SCHEMA,
        "scene": scene.name,
        "blender": scene.blender_version,
        "rtgi": RTGI_VERSION,
        "technique": field.technique,
        "settings": plain(settings),
        "seed": seed,
        "includes_direct": bool(field.includes_direct),
        "lamps": lamps,
        "objects": objects,
        "sh_convention": SH_CONVENTION,
        "volumes": volumes,
        **{part.key: part.index for part in parts},
        "notes": list(notes),
        "not_followed": plain(list(not_followed)),
        "sha256": {name: sha256_of_file(folder / name) for name in files},
        "bytes": {name: (folder / name).stat().st_size for name in files},
        "stats": plain(stats()),
    }
    write_file(folder / MANIFEST, manifest_bytes(manifest))


def check_bundle(path) -> dict:
    """The manifest of the bundle at ``path`` after every file's size and checksum was compared. Raises BakeError naming the first
    file that is missing or differs."""
    return _of_one_bake(path, _checked)


def read_bundle(path, progress: Progress | None = None) -> Bundle:
    """Check and read the bundle at ``path``. Raises BakeError naming the file for anything missing, damaged, of another size or
    place than `bake.json` says, or not finite, and for volumes that do not fit into memory; Cancelled."""
    progress = progress or Progress()
    return _of_one_bake(path, lambda place: _read(place, progress))


def _of_one_bake(path, read: Callable[[Path], _Read]) -> _Read:
    """What ``read`` makes of the bundle at ``path``; read again where a bake put another one there meanwhile: what is of both is
    neither's fault. Raises what ``read`` raises of a bundle that stayed."""
    while True:
        place = _located(path)
        before = _identity(place)
        try:
            return read(place)
        except BakeError:
            if _identity(_located(path)) == before:
                raise


def _checked(path: Path) -> dict:
    manifest = read_manifest(path)
    for name in manifest["sha256"]:
        _check_file(path, manifest, name)
    return manifest


def _read(path: Path, progress: Progress) -> Bundle:
    manifest = read_manifest(path)
    _require_memory(path, manifest)
    grids = tuple(_read_volume(path, manifest, entry, progress) for entry in manifest["volumes"])
    for name in manifest["sha256"].keys() - {name for entry in manifest["volumes"] for name in files_of(entry)}:
        _check_file(path, manifest, name)
    return Bundle(path, manifest, grids, read_media(path, manifest["sha256"]) if "media" in manifest else (),
                  read_spheres(path, manifest["sha256"]) if "spheres" in manifest else None,
                  read_atlas(path, manifest["sha256"]) if "atlas" in manifest else None,
                  read_voxels(path, manifest["sha256"]) if "voxels" in manifest else None)


def _identity(path: Path) -> tuple | None:
    """What tells one bundle from another that takes its name; None if there is none. File systems give the number of a folder that
    is gone to the next one, so the times of the folder and of its manifest count too."""
    try:
        stats = path.stat(), (path / MANIFEST).stat()
        return tuple((found.st_dev, found.st_ino, found.st_mtime_ns, found.st_ctime_ns) for found in stats)
    except OSError:
        return None


def _located(path) -> Path:
    """Where the bundle at ``path`` lies: beside it, if a run was killed while it was put in place. Nothing is mended here; the next
    bake to that place does it."""
    path = resolved(path)
    aside = replaced_of(path)
    return aside if not (path / MANIFEST).exists() and (aside / MANIFEST).is_file() else path


def _check_file(bundle: Path, manifest: dict, name: str) -> None:
    file = require_inside(bundle, name)
    _require_size(file, manifest, name)
    _require_digest(file, sha256_of_file(file), manifest, name)


def _require_size(file: Path, manifest: dict, name: str) -> None:
    """Before a byte is read: what was put in a file's place may be large."""
    with open_file(file) as (_, size):
        expected = manifest.get("bytes", {}).get(name, size)
    if size != expected:
        raise BakeError(f"{file} is cut short or damaged, it has {size:,} bytes instead of {expected:,}", RESTORE)


def _require_digest(file: Path, found: str, manifest: dict, name: str) -> None:
    if found != manifest["sha256"][name]:
        raise BakeError(f"{file} is cut short or damaged, its checksum is not the one in {MANIFEST}", RESTORE)


def _require_memory(bundle: Path, manifest: dict) -> None:
    needed, free = sum(volume_bytes(entry) for entry in manifest["volumes"]), available_bytes()
    if free is not None and needed > free:
        raise BakeError(f"{bundle} needs {needed / 2**30:.1f} GiB of memory, and {free / 2**30:.1f} GiB are free",
                        "close other programs, or bake it with a lower resolution")


def _read_volume(bundle: Path, manifest: dict, entry: dict, progress: Progress) -> ProbeGrid:
    resolution, cell = tuple(entry["resolution"]), entry["visibility_size"]
    tiles, visibility_tiles = (flipbook.Tiles(entry[key]["columns"], entry[key]["rows"]) for key in ("tiles", "visibility_tiles"))

    def read(key: str, letters: str, low: float = -np.inf, high: float = np.inf, coefficient: int | None = None) -> np.ndarray:
        """The image ``key`` as (nz, ny, nx, letters), or with cells as (nz, ny, nx, cell, cell, letters)."""
        progress.check()
        name, size_in = entry["sh"][coefficient] if key == "sh" else entry[key], resolution
        shown, side = (visibility_tiles, cell) if key == "visibility" else (tiles, 1)
        if key == "index":
            name, size_in, shown = name["file"], tuple(name["resolution"]), flipbook.Tiles(**name["tiles"])
        file = require_inside(bundle, name)
        size = shown.rows * size_in[1] * side, shown.columns * size_in[0] * side
        _require_size(file, manifest, name)
        data = read_file(file, largest_file(size))
        _require_digest(file, hashlib.sha256(data).hexdigest(), manifest, name)
        planes, header = decode_exr(data, file, size)
        require_image(file, planes, letters, header, image_header(entry, key, coefficient), MANIFEST)
        sheet = np.stack([planes[letter] for letter in letters], axis=-1, dtype=np.float32)
        _require_range(file, sheet, low, high, finite=key != "standard_error")
        if key == "visibility":
            return flipbook.octahedral_from_sheet(sheet, resolution, cell, shown)
        return flipbook.from_sheet(sheet, size_in, shown)

    validity = read("validity", "Y", 0.0, 1.0)[..., 0]
    offset, error = np.zeros((*validity.shape, 3), np.float32), np.full(validity.shape, np.nan, np.float32)
    if "offset" in entry:
        offset = read("offset", "RGB")
    if "standard_error" in entry:
        error = read("standard_error", "Y", 0.0)[..., 0]
    scattered = None
    if "index" in entry:
        index = read("index", "RGBA").astype(np.int32)
        _require_words(require_inside(bundle, entry["index"]["file"]), index, validity)
        scattered = of_grid(index, entry["world_from_local"], offset, validity)
    return ProbeGrid(
        volume=ProbeVolume(entry["name"], np.array(entry["world_from_local"], np.float64), resolution, bool(entry.get("fitted")),
                           scattered=scattered),
        sh=np.stack([read("sh", "RGB", coefficient=index) for index in range(len(entry["sh"]))], axis=3),
        validity=validity,
        visibility=read("visibility", "RG", 0.0),
        offset_world=offset,
        standard_error=error,
        fitted=entry.get("coefficients") == FITTED,
    )


def _require_words(file: Path, index: np.ndarray, validity: np.ndarray) -> None:
    """Raises BakeError unless every node of ``index`` names probes that are there."""
    probes, shares = named(index)
    there = np.append(validity.ravel() > 0.0, False)[np.minimum(probes, validity.size)]
    if np.any((shares > 0) & ~there) or not np.all((shares > 0).any(axis=-1)):
        raise BakeError(f"{file} is damaged, it names probes that are not there", RESTORE)


def _require_range(file: Path, values: np.ndarray, low: float, high: float, finite: bool) -> None:
    if finite and not np.isfinite(values).all():
        raise BakeError(f"{file} holds values that are not finite", RESTORE)
    # Not a number means not known, where that is allowed.
    if np.any(values < low) or np.any(values > high):
        raise BakeError(f"{file} holds values that are not from {low:g} to {high:g}", RESTORE)
