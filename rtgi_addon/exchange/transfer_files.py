"""Transfer as files beside a bundle's probes (docs/formats.md).

```
OUT/transfer/transfer.json             what is written here, and what the columns mean
OUT/transfer/world.exr                 the world that was baked, coarsely: Blender's equirectangular map, upright
OUT/transfer/<volume>/sky.exr          R G B what surfaces reflect of the sky, A what is seen of it: k × S a probe
OUT/transfer/<volume>/suns0.exr …      R G B coefficient 0 … of suns from each direction: side × side a probe; or of V vectors
OUT/transfer/vectors.exr               Y, float: what each direction takes of each vector, V × K, if suns are by vectors
OUT/transfer/<volume>/seen.exr         Y how much of these suns the probe sees: side × side
OUT/transfer/<volume>/lights.exr       R G B the bake's own lights: k × G, always in whole floats
OUT/transfer/<volume>/local.exr        R G B lamps of 1 W at the sites: k × J
```

Flipbooks as those of the probes, every pixel replaced by the matrix of its probe, row 0 on top.
"""

import json
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..scene import World
from ..storage.files import disk_error
from ..storage.parse import (
    Refused,
    exactly,
    file_name,
    flag,
    listing,
    number,
    one_of,
    read_document,
    record,
    require_inside,
    table,
    text,
    whole,
)
from ..storage.writing import write_text
from ..techniques.base import ProbeGrid
from ..techniques.transfer.columns import GROUP, SUNS, WORLD
from ..techniques.transfer.data import Transfer, TransferGrid
from ..techniques.transfer.stored import halves, table_error
from ..techniques.transfer.vectors import strongest
from . import flipbook
from .exr import read_exr, require_image, write_exr
from .names import folder_names
from .schema import RESTORE, SH_CONVENTION, TILES, require_tiles

SCHEMA = "rtgi-transfer/2"
FOLDER = "transfer"
INDEX = f"{FOLDER}/transfer.json"
WORLD_FILE, VECTORS_FILE = f"{FOLDER}/world.exr", f"{FOLDER}/vectors.exr"

_SIZE = whole(1, flipbook.MAX_SIDE)
_SHEET = record({"cell": listing(_SIZE, 2), "tiles": TILES})
_VOLUME = record({"name": text, "resolution": listing(_SIZE, 3), "sky": file_name, "sky_sheet": _SHEET, "suns": listing(file_name),
                  "seen": file_name, "suns_sheet": _SHEET},
                 {"lights": file_name, "lights_sheet": _SHEET, "local": file_name, "local_sheet": _SHEET, "vectors_sheet": _SHEET})
_NUMBERS = listing(number(-1e30, 1e30), 3)
_INDEX = record({
    "schema": text, "sh_convention": exactly(SH_CONVENTION), "order": whole(0, 8), "sky_order": whole(0, 8),
    "sun_side": whole(2, 1024), "sun_below": flag, "lights": listing(record({"name": text, "kind": one_of(WORLD, SUNS, GROUP)})),
    "sites": listing(_NUMBERS),
    "world": record({"file": file_name, "size": listing(_SIZE, 2), "map_from_world": listing(_NUMBERS, 3), "description": text}),
    "sources": table(text, record({"strength": _NUMBERS, "rest": text}, {"group": text})),
    "half": flag, "half_error": number(0.0), "bytes_per_probe": whole(0), "surfaces": table(text, text),
    "volumes": listing(_VOLUME)}, {"vectors": record({"file": file_name, "count": whole(1, 1024), "error": number(0.0)})})


def write_transfer(bundle, transfer: Transfer) -> list[str]:
    """Write ``transfer`` into the folder ``bundle`` and return the files' names relative to it.

    Raises BakeError for a disk that refuses, values that are not finite, and volumes larger than an image may be.
    """
    bundle, names, volumes, rounding = Path(bundle), [], [], _Rounding(transfer.half)
    folders = folder_names([grid.grid.volume.name for grid in transfer.grids],
                           reserved=["transfer.json", "world.exr", "vectors.exr"])
    vectors = None
    if 0 < transfer.sun_vectors < len(transfer.sun_directions):
        vectors = strongest([grid.suns for grid in transfer.grids], transfer.sun_vectors)
    try:
        (bundle / FOLDER).mkdir(parents=True, exist_ok=True)
        shared = {} if vectors is None else {"vectors": _write_vectors(bundle, vectors, transfer)}
        names += [entry["file"] for entry in shared.values()]
        for folder, grid in zip(folders, transfer.grids, strict=True):
            (bundle / FOLDER / folder).mkdir(exist_ok=True)
            entry, files = _write_volume(bundle, f"{FOLDER}/{folder}", grid, transfer, rounding, vectors)
            volumes.append(entry)
            names += files
        pixels = np.asarray(transfer.world.equirect, np.float32)
        # In files row 0 is the top, as pictures of skies have it.
        write_exr(bundle / WORLD_FILE, {letter: pixels[::-1, :, c] for c, letter in enumerate("RGB")},
                  {"schema": SCHEMA, "kind": "world"})
        index = {
            "schema": SCHEMA, "sh_convention": SH_CONVENTION, "order": transfer.order, "sky_order": transfer.sky_order,
            "sun_side": transfer.sun_side, "sun_below": transfer.sun_below,
            "lights": [{"name": name, "kind": kind} for name, kind in transfer.lights],
            "sites": np.asarray(transfer.sites).tolist(),
            "world": {"file": WORLD_FILE, "size": [pixels.shape[1], pixels.shape[0]],
                      "map_from_world": np.asarray(transfer.world.map_from_world, np.float64).tolist(),
                      "description": transfer.world.description},
            "half": transfer.half, "half_error": rounding.error, "bytes_per_probe": transfer.bytes_per_probe,
            "surfaces": transfer.surfaces, "sources": transfer.sources, "volumes": volumes, **shared}
        write_text(bundle / INDEX, json.dumps(index, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / FOLDER, error) from error
    return [*names, WORLD_FILE, INDEX]


def read_index(bundle) -> dict:
    """The checked transfer.json of the bundle's folder. Raises BakeError naming what is missing or damaged."""
    return read_document(Path(bundle) / INDEX, SCHEMA, _check_index, RESTORE)


def read_transfer(bundle, grids: tuple[ProbeGrid, ...]) -> Transfer:
    """The transfer in the folder ``bundle``, whose probes are ``grids``. Raises BakeError naming a file that is missing or
    damaged, or does not belong to them."""
    bundle, index = Path(bundle), read_index(bundle)
    entries = index["volumes"]
    if [(entry["name"], tuple(entry["resolution"])) for entry in entries] != [
            (grid.volume.name, tuple(grid.volume.resolution)) for grid in grids]:
        raise BakeError(f"{bundle / INDEX} does not belong to the bundle, its volumes are others", RESTORE)
    world, vectors = index["world"], _read_vectors(bundle, index)
    width, height = world["size"]
    planes, _ = read_exr(require_inside(bundle, world["file"]), (height, width))
    equirect = np.stack([planes[letter][::-1] for letter in "RGB"], axis=-1).astype(np.float32)
    return Transfer(
        tuple(_read_volume(bundle, entry, grid, index, vectors) for entry, grid in zip(entries, grids, strict=True)),
        index["order"], index["sky_order"], index["sun_side"], index["sun_below"],
        tuple((light["name"], light["kind"]) for light in index["lights"]),
        np.array(index["sites"], np.float64).reshape(-1, 3),
        World(equirect, np.array(world["map_from_world"], np.float64), world["description"]),
        index["surfaces"], index["sources"], index["half"], 0 if vectors is None else len(vectors))


def _write_vectors(bundle: Path, vectors: np.ndarray, transfer: Transfer) -> dict:
    """Write ``vectors`` (V, K) and return their entry of the index, with the relative RMS ``error`` of suns by them."""
    write_exr(bundle / VECTORS_FILE, {"Y": vectors}, {"schema": SCHEMA, "kind": "vectors"})
    error = table_error((grid.suns for grid in transfer.grids), lambda plane: plane @ vectors.T @ vectors)
    return {"file": VECTORS_FILE, "count": len(vectors), "error": error}


def _read_vectors(bundle: Path, index: dict) -> np.ndarray | None:
    entry = index.get("vectors")
    if entry is None:
        return None
    path, directions = require_inside(bundle, entry["file"]), index["sun_side"] ** 2 * (1 + index["sun_below"])
    planes, header = read_exr(path, (entry["count"], directions))
    require_image(path, planes, "Y", header, {"schema": SCHEMA, "kind": "vectors"}, INDEX)
    if not np.isfinite(planes["Y"]).all():
        raise BakeError(f"{path} holds values that are not finite", RESTORE)
    return planes["Y"].astype(np.float32)


class _Rounding:
    """Rounds to half floats if ``half``, and keeps by how much."""

    def __init__(self, half: bool):
        self._half, self._off, self._all = half, 0.0, 0.0

    def __call__(self, values: np.ndarray) -> np.ndarray:
        if not self._half:
            return np.asarray(values, np.float32)
        rounded = halves(values)
        self._off += float(np.square(rounded.astype(np.float32) - values).sum(dtype=np.float64))
        self._all += float(np.square(values).sum(dtype=np.float64))
        return rounded

    @property
    def error(self) -> float:
        """Relative RMS error of all that was rounded."""
        return float(np.sqrt(self._off / self._all)) if self._all else 0.0


def _write_volume(bundle: Path, folder: str, grid: TransferGrid, transfer: Transfer, rounding: _Rounding,
                  vectors: np.ndarray | None) -> tuple[dict, list[str]]:
    resolution = [int(n) for n in grid.grid.volume.resolution]
    side, k = transfer.sun_side, grid.coefficients
    names = [f"{folder}/{name}.exr" for name in ("sky", "seen", "lights", "local")]
    entry = {"name": grid.grid.volume.name, "resolution": resolution, "sky": names[0],
             "sky_sheet": _sheet_of(resolution, (k, grid.sky.shape[4])),
             "suns": [f"{folder}/suns{index}.exr" for index in range(k)],
             "seen": names[1], "suns_sheet": _sheet_of(resolution, (side * (1 + transfer.sun_below), side))}
    if vectors is not None:
        entry["vectors_sheet"] = _sheet_of(resolution, (1, len(vectors)))
    of_light = [("lights", grid.lights, names[2])] if grid.lights.shape[5] else []
    of_light += [("local", grid.local, names[3])] if grid.local.shape[5] else []
    for key, values, name in of_light:
        entry |= {key: name, f"{key}_sheet": _sheet_of(resolution, (k, values.shape[5]))}
    written = []

    def write(name, kind, letters, planes, sheet) -> None:
        for plane in planes:
            if not np.isfinite(plane).all():
                raise BakeError(f"volume {entry['name']!r}: its transfer of {kind} is not finite",
                                "look for infinite light strengths in the scene, and report this with the file")
        write_exr(bundle / name, {letter: _to_sheet(plane, sheet) for letter, plane in zip(letters, planes, strict=True)},
                  _header(entry, kind, sheet))
        written.append(name)

    write(entry["sky"], "sky", "RGBA", [rounding(part) for part in (*grid.bounce, grid.sky)], entry["sky_sheet"])
    sheet, suns = entry["suns_sheet"], grid.suns
    if vectors is not None:
        sheet, suns = entry["vectors_sheet"], [part @ vectors.T for part in grid.suns]
    for index, name in enumerate(entry["suns"]):
        planes = [rounding(part[..., index, :].reshape(*grid.shape, *sheet["cell"])) for part in suns]
        write(name, f"suns{index}", "RGB", planes, sheet)
    cell = entry["suns_sheet"]["cell"]
    write(entry["seen"], "seen", "Y", [rounding(grid.seen.reshape(*grid.shape, *cell))], entry["suns_sheet"])
    for key, values, name in of_light:
        write(name, key, "RGB", [part if key == "lights" else rounding(part) for part in values], entry[f"{key}_sheet"])
    return entry, written


def _read_volume(bundle: Path, entry: dict, grid: ProbeGrid, index: dict, vectors: np.ndarray | None) -> TransferGrid:
    def read(name, kind, letters, sheet) -> np.ndarray:
        """(letters, nz, ny, nx, rows, columns)."""
        path, tiles = require_inside(bundle, name), flipbook.Tiles(**sheet["tiles"])
        nx, ny, _ = entry["resolution"]
        rows, columns = sheet["cell"]
        planes, header = read_exr(path, (tiles.rows * ny * rows, tiles.columns * nx * columns))
        require_image(path, planes, letters, header, _header(entry, kind, sheet), INDEX)
        values = np.stack([_from_sheet(planes[letter].astype(np.float32), entry["resolution"], sheet) for letter in letters])
        if not np.isfinite(values).all():
            raise BakeError(f"{path} holds values that are not finite", RESTORE)
        return values

    k, skies = (index["order"] + 1) ** 2, (index["sky_order"] + 1) ** 2
    shape = tuple(reversed(entry["resolution"]))
    sky = read(entry["sky"], "sky", "RGBA", entry["sky_sheet"])
    suns = np.empty((3, *shape, k, int(np.prod(entry["suns_sheet"]["cell"]))), np.float32)
    for coefficient, name in enumerate(entry["suns"]):
        found = read(name, f"suns{coefficient}", "RGB", entry["suns_sheet" if vectors is None else "vectors_sheet"])
        suns[..., coefficient, :] = found.reshape(3, *shape, -1) if vectors is None else found.reshape(3, *shape, -1) @ vectors
    seen = read(entry["seen"], "seen", "Y", entry["suns_sheet"])[0].reshape(*shape, -1)
    empty = np.zeros((3, *shape, k, 0), np.float32)
    lights, local = (read(entry[key], key, "RGB", entry[f"{key}_sheet"]) if key in entry else empty for key in ("lights", "local"))
    if sky.shape[-2:] != (k, skies) or lights.shape[5] != len(index["lights"]) or local.shape[5] != len(index["sites"]):
        raise BakeError(f"{bundle / INDEX} is damaged, its numbers of columns are not those of its images", RESTORE)
    return TransferGrid(grid, sky[3], sky[:3], suns, seen, lights, local)


def _sheet_of(resolution: list[int], cell: tuple[int, int]) -> dict:
    nx, ny, nz = resolution
    tiles = flipbook.layout([nx * cell[1], ny * cell[0], nz])
    return {"cell": [int(n) for n in cell], "tiles": tiles._asdict()}


def _to_sheet(values: np.ndarray, sheet: dict) -> np.ndarray:
    """(nz, ny, nx, rows, columns) as one image."""
    nz, ny, nx, rows, columns = values.shape
    flat = values.transpose(0, 1, 3, 2, 4).reshape(nz, ny * rows, nx * columns, 1)
    return flipbook.to_sheet(flat, flipbook.Tiles(**sheet["tiles"]))[..., 0]


def _from_sheet(image: np.ndarray, resolution: list[int], sheet: dict) -> np.ndarray:
    (nx, ny, nz), (rows, columns) = resolution, sheet["cell"]
    flat = flipbook.from_sheet(image[..., None], (nx * columns, ny * rows, nz), flipbook.Tiles(**sheet["tiles"]))
    return flat.reshape(nz, ny, rows, nx, columns).transpose(0, 1, 3, 2, 4)


def _header(entry: dict, kind: str, sheet: dict) -> dict:
    """What an image repeats of its volume's entry."""
    return {"schema": SCHEMA, "volume": entry["name"], "kind": kind, "resolution": entry["resolution"], **sheet}


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    for place, entry in enumerate(index["volumes"]):
        if len(entry["suns"]) != (index["order"] + 1) ** 2:
            raise Refused(f"volumes[{place}].suns are {len(entry['suns'])} files")
        if ("vectors" in index) != ("vectors_sheet" in entry) or (
                "vectors" in index and entry["vectors_sheet"]["cell"] != [1, index["vectors"]["count"]]):
            raise Refused(f"volumes[{place}].vectors_sheet is not that of the vectors of suns")
        for key in ("sky", "suns", "vectors", "lights", "local"):
            if f"{key}_sheet" in entry:
                (nx, ny, nz), (rows, columns) = entry["resolution"], entry[f"{key}_sheet"]["cell"]
                require_tiles(entry[f"{key}_sheet"]["tiles"], [nx * columns, ny * rows, nz], f"volumes[{place}].{key}_sheet")
        if int(np.prod(entry["suns_sheet"]["cell"])) != index["sun_side"] ** 2 * (1 + index["sun_below"]):
            raise Refused(f"volumes[{place}].suns_sheet is not that of {index['sun_side']} directions a side")
