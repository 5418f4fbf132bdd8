"""Light propagation volumes as files: every cascade's coefficients per cell, as flipbooks beside a bundle's probes.

```
OUT/lpv/lpv.json                 what is written here, and how to read it
OUT/lpv/cascade<k>/sh0.exr … sh3.exr    accumulated intensity [W/sr] of each cell: SH 1, y, z, x; channels R G B
OUT/lpv/cascade<k>/open.exr             what the faces above each cell along x, y, z let through of light; channels R G B
OUT/lpv/cascade<k>/crossing.exr         where surfaces cross those faces, in cells above the face's plane
```

Cascade 0 is the finest. Cells are cubes along the world's axes; slice z is a tile as in the probes' flipbooks. The irradiance on
a surface with normal n is (a·Y0·c0 - b·Y1·(c1·n))/cell^2, not below 0, of the coefficients ``surface_cells`` cells in front of it;
Y0 = .282095, Y1 = .488603, a is ``face_total`` and b ``face_ahead`` of lpv.json (techniques/lpv/gather.py derives them). Which
cells there are on the surface's side of the walls follows from the faces (techniques/lpv/standing.py).
"""

import json
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..storage.files import disk_error
from ..storage.parse import exactly, file_name, flag, listing, number, read_document, record, require_inside, text, whole
from ..storage.writing import write_text
from ..techniques.lpv.field import LpvField
from ..techniques.lpv.gather import FACE_AHEAD, FACE_TOTAL, SURFACE_CELLS
from ..techniques.lpv.grid import LpvGrid
from . import flipbook
from .exr import read_exr, require_image, write_exr
from .schema import RESTORE, TILES, require_tiles

SCHEMA = "rtgi-lpv/2"
FOLDER = "lpv"
INDEX = f"{FOLDER}/lpv.json"
SH_CONVENTION = "real-orthonormal, no Condon-Shortley, accumulated radiant intensity, Z-up"

_CASCADE = record({"corner": listing(number(-1e30, 1e30), 3), "cell": number(1e-30, 1e30),
                   "resolution": listing(whole(1, flipbook.MAX_SIDE), 3), "tiles": TILES, "sh": listing(file_name, 4),
                   "open": file_name, "crossing": file_name})
_INDEX = record({"schema": text, "sh_convention": exactly(SH_CONVENTION), "cascades": listing(_CASCADE), "face_total": number(),
                 "face_ahead": number(), "surface_cells": number(), "dampening": flag})


def write_lpv_volume(bundle, field: LpvField) -> list[str]:
    """Write the cascades of ``field`` into the folder ``bundle`` and return the files' names relative to it.

    Raises BakeError for a disk that refuses, values that are not finite, and a volume larger than an image may be.
    """
    bundle = Path(bundle)
    names, cascades = [], []
    for level, (grid, volume, faces) in enumerate(zip(field.volume_grids, field.volumes, field.faces, strict=True)):
        if not np.isfinite(volume).all():
            raise BakeError(f"cascade {level} of the light propagation volumes is not finite",
                            "look for infinite light strengths in the scene, and report this with the file")
        folder = f"{FOLDER}/cascade{level}"
        tiles = flipbook.layout(grid.resolution)
        entry = {"corner": list(grid.corner), "cell": grid.cell, "resolution": list(grid.resolution), "tiles": tiles._asdict(),
                 "sh": [f"{folder}/sh{index}.exr" for index in range(4)], "open": f"{folder}/open.exr",
                 "crossing": f"{folder}/crossing.exr"}
        let_through, crossing = (np.ones((3, *grid.shape)), np.zeros((3, *grid.shape))) if faces is None else np.split(faces, 2)
        try:
            (bundle / folder).mkdir(parents=True, exist_ok=True)
            for (name, content), values in zip(_contents(entry), (*volume, let_through, crossing), strict=True):
                sheet = flipbook.to_sheet(np.moveaxis(values, 0, -1), tiles)
                write_exr(bundle / name, {letter: sheet[..., channel] for channel, letter in enumerate("RGB")},
                          _image_header(entry, level, content))
        except OSError as error:
            raise disk_error(bundle / folder, error) from error
        names += [name for name, _ in _contents(entry)]
        cascades.append(entry)
    index = {"schema": SCHEMA, "sh_convention": SH_CONVENTION, "cascades": cascades, "face_total": FACE_TOTAL,
             "face_ahead": FACE_AHEAD, "surface_cells": SURFACE_CELLS, "dampening": bool(field.params.get("dampening", False))}
    try:
        write_text(bundle / INDEX, json.dumps(index, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / INDEX, error) from error
    return [*names, INDEX]


def read_lpv_volume(bundle) -> LpvField:
    """The field whose volumes lie in the folder ``bundle``. Raises BakeError naming a file that is missing or damaged."""
    bundle = Path(bundle)
    index = read_document(bundle / INDEX, SCHEMA, _check_index, RESTORE)
    grids, volumes, faces = [], [], []
    for level, entry in enumerate(index["cascades"]):
        grid = LpvGrid(tuple(map(float, entry["corner"])), float(entry["cell"]), tuple(entry["resolution"]))
        rows = [_values(bundle, name, grid, _image_header(entry, level, content)) for name, content in _contents(entry)]
        grids.append(grid)
        volumes.append(np.stack(rows[:4]))
        faces.append(np.concatenate(rows[4:]))
    return LpvField(tuple(grids), tuple(volumes), tuple(faces), params={"dampening": index["dampening"]}, stats={})


def _contents(entry: dict) -> list[tuple[str, int | str]]:
    """The images of a cascade and what they hold: the number of a coefficient, or what of the faces."""
    return [*((name, number) for number, name in enumerate(entry["sh"])), (entry["open"], "open"), (entry["crossing"], "crossing")]


def _image_header(entry: dict, level: int, content: int | str) -> dict:
    """What the image of ``content`` (of ``_contents``) of a cascade repeats of its entry."""
    what = {"faces": content} if isinstance(content, str) else {"coefficient": content}
    return {"schema": SCHEMA, "cascade": level, **what, "sh_convention": SH_CONVENTION,
            **{key: entry[key] for key in ("corner", "cell", "resolution", "tiles")}}


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    for level, entry in enumerate(index["cascades"]):
        require_tiles(entry["tiles"], entry["resolution"], f"cascades[{level}].tiles")


def _values(bundle: Path, name: str, grid: LpvGrid, header: dict) -> np.ndarray:
    """Three values (3, nz, ny, nx) float32 of every cell."""
    path, tiles = require_inside(bundle, name), flipbook.Tiles(**header["tiles"])
    planes, found = read_exr(path, (tiles.rows * grid.resolution[1], tiles.columns * grid.resolution[0]))
    require_image(path, planes, "RGB", found, header, INDEX)
    sheet = np.stack([planes[letter] for letter in "RGB"], axis=-1, dtype=np.float32)
    if not np.isfinite(sheet).all():
        raise BakeError(f"{path} holds values that are not finite", RESTORE)
    return np.ascontiguousarray(np.moveaxis(flipbook.from_sheet(sheet, grid.resolution, tiles), -1, 0))
