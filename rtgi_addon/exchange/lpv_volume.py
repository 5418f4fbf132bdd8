"""Light propagation volumes as files: every cascade's coefficients per cell, as flipbooks beside a bundle's probes.

```
OUT/lpv/lpv.json                 what is written here, and how to read it
OUT/lpv/cascade<k>/sh0.exr … sh3.exr    accumulated intensity [W/sr] of each cell: SH 1, y, z, x; channels R G B
```

Cascade 0 is the finest. Cells are cubes along the world's axes; slice z is a tile as in the probes' flipbooks. The irradiance on
a surface with normal n is (a·Y0·c0 - b·Y1·(c1·n))/cell^2, not below 0, of the coefficients ``surface_cells`` cells in front of it;
Y0 = .282095, Y1 = .488603, a is ``face_total`` and b ``face_ahead`` of lpv.json (techniques/lpv/gather.py derives them).
"""

import json
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..techniques.lpv.field import LpvField
from ..techniques.lpv.gather import FACE_AHEAD, FACE_TOTAL, SURFACE_CELLS
from ..techniques.lpv.grid import LpvGrid
from . import flipbook
from .exr import read_exr, write_exr
from .files import disk_error, sync_file, sync_folder, write_atomically
from .schema import RESTORE

SCHEMA = "rtgi-lpv/1"
FOLDER = "lpv"
INDEX = f"{FOLDER}/lpv.json"
SH_CONVENTION = "real-orthonormal, no Condon-Shortley, accumulated radiant intensity, Z-up"


def write_lpv_volume(bundle, field: LpvField) -> list[str]:
    """Write the cascades of ``field`` into the folder ``bundle`` and return the files' names relative to it.

    Raises BakeError for a disk that refuses, values that are not finite, and a volume larger than an image may be.
    """
    bundle = Path(bundle)
    names, cascades = [], []
    for level, (grid, volume) in enumerate(zip(field.volume_grids, field.volumes, strict=True)):
        if not np.isfinite(volume).all():
            raise BakeError(f"cascade {level} of the light propagation volumes is not finite",
                            "look for infinite light strengths in the scene, and report this with the file")
        folder = f"{FOLDER}/cascade{level}"
        tiles = flipbook.layout(grid.resolution)
        entry = {"corner": list(grid.corner), "cell": grid.cell, "resolution": list(grid.resolution), "tiles": tiles._asdict(),
                 "sh": [f"{folder}/sh{index}.exr" for index in range(4)]}
        try:
            (bundle / folder).mkdir(parents=True)
            for index, name in enumerate(entry["sh"]):
                sheet = flipbook.to_sheet(np.moveaxis(volume[index], 0, -1), tiles)
                write_exr(bundle / name, {letter: sheet[..., channel] for channel, letter in enumerate("RGB")},
                          {"schema": SCHEMA, "cascade": level, "coefficient": index, "sh_convention": SH_CONVENTION,
                           **{key: entry[key] for key in ("corner", "cell", "resolution", "tiles")}})
                sync_file(bundle / name)
            sync_folder(bundle / folder)
        except OSError as error:
            raise disk_error(bundle / folder, error) from error
        names += entry["sh"]
        cascades.append(entry)
    index = {"schema": SCHEMA, "sh_convention": SH_CONVENTION, "cascades": cascades, "face_total": FACE_TOTAL,
             "face_ahead": FACE_AHEAD, "surface_cells": SURFACE_CELLS, "dampening": bool(field.params.get("dampening", True))}
    try:
        write_atomically(bundle / INDEX, (json.dumps(index, indent=1, allow_nan=False) + "\n").encode())
        sync_folder(bundle / FOLDER)
    except OSError as error:
        raise disk_error(bundle / INDEX, error) from error
    return [*names, INDEX]


def read_lpv_volume(bundle) -> LpvField:
    """The field whose volumes lie in the folder ``bundle``. Raises BakeError naming a file that is missing or damaged."""
    bundle = Path(bundle)
    path = bundle / INDEX
    try:
        index = json.loads(path.read_text(encoding="utf-8"))
        if index["schema"] != SCHEMA:
            raise BakeError(f"{path} has schema {index['schema']!r} instead of {SCHEMA!r}", RESTORE)
        grids, volumes = [], []
        for entry in index["cascades"]:
            grid = LpvGrid(tuple(map(float, entry["corner"])), float(entry["cell"]), tuple(map(int, entry["resolution"])))
            tiles = flipbook.Tiles(entry["tiles"]["columns"], entry["tiles"]["rows"])
            rows = [_coefficient(bundle / name, grid, tiles) for name in entry["sh"]]
            grids.append(grid)
            volumes.append(np.stack(rows))
        return LpvField(tuple(grids), tuple(volumes), params={"dampening": bool(index["dampening"])}, stats={})
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    except (ValueError, KeyError, TypeError) as error:
        raise BakeError(f"{path} is damaged", RESTORE) from error


def _coefficient(path: Path, grid: LpvGrid, tiles: flipbook.Tiles) -> np.ndarray:
    """One coefficient (3, nz, ny, nx) float32 of every cell."""
    planes, _ = read_exr(path)
    if set(planes) != set("RGB"):
        raise BakeError(f"{path} has channels {', '.join(sorted(planes))} instead of R, G, B", RESTORE)
    try:
        sheet = np.stack([planes[letter] for letter in "RGB"], axis=-1, dtype=np.float32)
        volume = flipbook.from_sheet(sheet, grid.resolution, tiles)
    except ValueError as error:
        raise BakeError(f"{path} has the wrong size, {error}", RESTORE) from error
    return np.ascontiguousarray(np.moveaxis(volume, -1, 0))
