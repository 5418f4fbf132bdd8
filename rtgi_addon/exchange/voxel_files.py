"""Lit voxels of a bundle (docs/formats.md): opacity and radiance of all levels, for readers that trace cones themselves.

```
OUT/voxels/voxels.json   where the grid lies, its levels, the cones, the sky as harmonics
OUT/voxels/rows.exr      Y, float: of every cell of every level its row in the lists, 0 for empty ones; and a half, see docs
OUT/voxels/cells.exr     R G B A, half: of each row three texels, opacity
OUT/voxels/light.exr     R G B, half (float where it is brighter): of each row eight texels, radiance
```

Lists lie in their images from left to right and from the top, and no item goes over the end of a line. A level is a flipbook within
`rows`: its cells x by x, line by line, slice by slice, with an empty layer around them. Only techniques that see a scene in voxels
write these files.
"""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..storage.files import disk_error
from ..storage.parse import Refused, exactly, file_name, listing, number, read_document, record, require_inside, text, whole
from ..storage.writing import write_text
from ..techniques.voxels.shipped import ShippedVoxels
from ..transport.voxels import VoxelGrid
from ..transport.voxels.tables import CELL_NUMBERS, COLOURS, VoxelTables
from .exr import read_exr, require_image, write_exr
from .flipbook import MAX_SIDE
from .schema import RESTORE, SH_CONVENTION

SCHEMA = "rtgi-voxels/1"
FOLDER = "voxels"
INDEX = f"{FOLDER}/voxels.json"
# Texels of a line of lists at most.
_WIDTH = 4096
# Texels of a row's opacity, and those of its radiance.
CELL_TEXELS, LIGHT_TEXELS = CELL_NUMBERS // 4, COLOURS

_COUNT = whole(1, 2**31)
_LEVEL = record({"resolution": listing(_COUNT, 3), "first": whole(0, 2**31)})
_PLACE = {"corner": listing(number(-1e30, 1e30), 3), "cell": number(1e-30, 1e30), "resolution": listing(_COUNT, 3)}
_INDEX = record({"schema": text, "sh_convention": exactly(SH_CONVENTION), **_PLACE, "levels": listing(_LEVEL),
                 "cells_count": _COUNT, "rows_count": _COUNT, "rows": file_name, "cells": file_name, "light": file_name,
                 "cones": whole(6, 256), "step": number(0.0), "near": number(0.0), "sky": listing(listing(number(), 3), 9),
                 "left": listing(text)},
                {"cascades": listing(record(_PLACE))})
# How far cells of nested grids may be off twice those within, and off their lattice.
_ROUNDING = 1e-4


def fold(items: np.ndarray, texels: int) -> np.ndarray:
    """``items`` (n, texels, c) as an image (h, w, c), as the module's docstring has it."""
    per_line = max(1, min(len(items), _WIDTH // texels))
    lines = -(-len(items) // per_line)
    sheet = np.zeros((lines * per_line, texels, items.shape[2]), items.dtype)
    sheet[:len(items)] = items
    return sheet.reshape(lines, per_line * texels, -1)


def unfold(sheet: np.ndarray, count: int, texels: int) -> np.ndarray:
    """The ``count`` items (n, texels, c) of an image of ``fold``."""
    return sheet.reshape(-1, texels, sheet.shape[2])[:count]


def lists_of(tables: VoxelTables) -> dict[str, tuple[np.ndarray, int]]:
    """Items (n, texels, c) of the three lists, by name, and their texels."""
    return {"rows": ((tables.rows + np.float32(0.5) * tables.wide).astype(np.float32).reshape(-1, 1, 1), 1),
            "cells": (tables.cells.astype(np.float16).reshape(-1, CELL_TEXELS, 4), CELL_TEXELS),
            "light": (tables.light, LIGHT_TEXELS)}


def write_voxels(bundle, voxels: ShippedVoxels) -> list[str]:
    """Write ``voxels`` into the folder ``bundle`` and return the files' names relative to it. Raises BakeError for a disk that
    refuses, values that are not finite, and more voxels than an image holds."""
    bundle, tables = Path(bundle), voxels.tables
    if not (np.isfinite(tables.light).all() and np.isfinite(tables.cells).all()):
        raise BakeError("the voxels hold values that are not finite",
                        "look for infinite light strengths in the scene, and report this with the file")
    index = {
        "schema": SCHEMA, "sh_convention": SH_CONVENTION, **_place(tables.grid),
        **({"cascades": [_place(grid) for grid in tables.grids]} if len(tables.grids) > 1 else {}),
        "levels": [{"resolution": shape[:3], "first": shape[3]} for shape in tables.shapes.tolist()],
        "cells_count": len(tables.rows), "rows_count": len(tables.cells), **{name: f"{FOLDER}/{name}.exr" for name in _LETTERS},
        "cones": voxels.cones, "step": voxels.step, "near": voxels.near, "sky": voxels.sky.tolist(), "left": list(voxels.left)}
    try:
        (bundle / FOLDER).mkdir(parents=True, exist_ok=True)
        for name, (items, texels) in lists_of(tables).items():
            sheet = fold(items, texels)
            if len(sheet) > MAX_SIDE:
                raise BakeError(f"{len(tables.cells):,} voxels that hold surfaces are more than an image takes",
                                "lower the resolution")
            write_exr(bundle / index[name], {letter: np.ascontiguousarray(sheet[..., c]) for c, letter in
                                             enumerate(_LETTERS[name])}, _header(index, name))
        write_text(bundle / INDEX, json.dumps(index, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / FOLDER, error) from error
    return [*(index[name] for name in _LETTERS), INDEX]


def read_voxels(bundle, known) -> ShippedVoxels:
    """The lit voxels whose files lie in the folder ``bundle``, of which all are among the ``known`` ones, by name, that have
    checksums. Raises BakeError naming a file that is missing, damaged or has none."""
    bundle = Path(bundle)
    index = read_document(bundle / INDEX, SCHEMA, _check_index, RESTORE)
    unknown = next((index[name] for name in _LETTERS if index[name] not in known), None)
    if unknown is not None:
        raise BakeError(f"{bundle / INDEX} names {unknown}, which has no checksum", RESTORE)
    counts = {"rows": (index["cells_count"], 1), "cells": (index["rows_count"], CELL_TEXELS),
              "light": (index["rows_count"], LIGHT_TEXELS)}

    def read(name: str) -> np.ndarray:
        count, texels = counts[name]
        path, per_line = require_inside(bundle, index[name]), max(1, min(count, _WIDTH // texels))
        planes, header = read_exr(path, (-(-count // per_line), per_line * texels))
        require_image(path, planes, _LETTERS[name], header, _header(index, name), INDEX)
        sheet = np.stack([planes[letter] for letter in _LETTERS[name]], axis=-1)
        if not np.isfinite(sheet).all():
            raise BakeError(f"{path} holds values that are not finite", RESTORE)
        return unfold(sheet, count, texels)

    rows, cells, light = (read(name) for name in _LETTERS)
    numbers = rows.reshape(-1)
    rows, wide = numbers.astype(np.int32), numbers % 1 > 0
    shapes = np.array([[*level["resolution"], level["first"]] for level in index["levels"]], np.int64)
    if rows.min() < 0 or rows.max() >= len(cells) or np.count_nonzero(rows) != len(cells) - 1:
        raise BakeError(f"{bundle / index['rows']} names other rows than there are", RESTORE)
    tables = VoxelTables(_grids(index), shapes, rows, cells.reshape(len(cells), -1), light, wide)
    return ShippedVoxels(tables, index["cones"], index["step"], index["near"], np.array(index["sky"], np.float64),
                         tuple(index["left"]))


_LETTERS = {"rows": "Y", "cells": "RGBA", "light": "RGB"}


def _header(index: dict, name: str) -> dict:
    """What an image repeats of the index, so that it can be read alone."""
    return {key: index[key] for key in ("schema", "corner", "cell", "resolution", "levels", "cascades", "cells_count", "rows_count")
            if key in index} | {"list": name}


def _place(grid: VoxelGrid) -> dict:
    return {"corner": list(grid.corner), "cell": grid.cell, "resolution": list(grid.resolution)}


def _grids(index: dict) -> tuple[VoxelGrid, ...]:
    return tuple(VoxelGrid(tuple(map(float, place["corner"])), float(place["cell"]), tuple(place["resolution"]))
                 for place in index.get("cascades", [index]))


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    if 6 < index["cones"] < 12:
        raise Refused(f"{index['cones']} cones are none that can be traced")
    grids, first, inner = _grids(index), 0, ()
    _check_cascades(index, grids)
    for which, level in enumerate(index["levels"]):
        inner = grids[which].resolution if which < len(grids) else [-(-count // 2) for count in inner]
        if level["resolution"] != [count + 2 for count in inner] or level["first"] != first:
            raise Refused("levels are not those of its resolution")
        first += int(np.prod(level["resolution"]))
    if first != index["cells_count"]:
        raise Refused(f"its levels have {first} cells, and not {index['cells_count']}")


def _check_cascades(index: dict, grids: tuple[VoxelGrid, ...]) -> None:
    if not grids or _place(grids[0]) != {key: index[key] for key in _PLACE} or len(index["levels"]) < len(grids):
        raise Refused("cascades are not those of its levels")
    for inner, outer in pairwise(grids):
        corner, high = ((np.asarray(end) - outer.corner) / inner.cell for end in (inner.corner, inner.high))
        nested = np.all(corner > -_ROUNDING) and np.all(high < 2.0 * np.asarray(outer.resolution) + _ROUNDING)
        if not nested or abs(outer.cell / inner.cell - 2.0) > _ROUNDING or np.abs(corner - np.round(corner)).max() > _ROUNDING:
            raise Refused("cascades do not lie within each other, in cells twice as large")
