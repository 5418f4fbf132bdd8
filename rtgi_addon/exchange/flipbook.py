"""Volumes as flat sheets and back (docs/formats.md): slice z is the tile at column z mod columns, row z div columns.

Inside a tile x grows to the right and y down the stored scanlines (scanline 0 is the top of the file). An octahedral sheet
is the same with every probe's pixel replaced by its T×T map, row 0 of the map on top.
"""

from typing import NamedTuple

import numpy as np

from ..errors import BakeError
from ..techniques.base import MAX_TEXTURE_SIDE

MAX_SIDE = MAX_TEXTURE_SIDE


class Tiles(NamedTuple):
    """How many slices lie side by side, and how many rows of them there are."""

    columns: int
    rows: int


def layout(resolution, cell: int = 1, max_side: int = MAX_SIDE) -> Tiles:
    """The tiles for ``resolution`` (x, y, z) probes of ``cell`` × ``cell`` pixels: one column unless a side would pass
    ``max_side``. Raises BakeError if no arrangement fits."""
    width, height, slices = resolution[0] * cell, resolution[1] * cell, resolution[2]
    if height <= max_side and width <= max_side:
        rows = min(slices, max_side // height)
        columns = -(-slices // rows)
        if columns * width <= max_side:
            return Tiles(columns, -(-slices // columns))
    raise BakeError(f"a volume of {_size(resolution)} probes does not fit an image of {max_side} pixels a side",
                    "lower its resolution or split it into several volumes")


def _size(numbers) -> str:
    return " × ".join(map(str, numbers))


def to_sheet(volume: np.ndarray, tiles: Tiles) -> np.ndarray:
    """(nz, ny, nx, channels) → (rows·ny, columns·nx, channels); tiles that hold no slice are 0."""
    slices, height, width, channels = volume.shape
    padded = np.zeros((tiles.rows * tiles.columns, height, width, channels), volume.dtype)
    padded[:slices] = volume
    grid = padded.reshape(tiles.rows, tiles.columns, height, width, channels)
    return grid.transpose(0, 2, 1, 3, 4).reshape(tiles.rows * height, tiles.columns * width, channels)


def from_sheet(sheet: np.ndarray, resolution, tiles: Tiles) -> np.ndarray:
    """The inverse of ``to_sheet`` for ``resolution`` (x, y, z). Raises ValueError if the sheet's size is another one."""
    width, height, slices = resolution
    if sheet.shape[:2] != (tiles.rows * height, tiles.columns * width) or slices > tiles.rows * tiles.columns:
        raise ValueError(f"{_size(sheet.shape[1::-1])} pixels do not hold {_size(resolution)} samples")
    grid = sheet.reshape(tiles.rows, height, tiles.columns, width, sheet.shape[2]).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(grid.reshape(tiles.rows * tiles.columns, height, width, sheet.shape[2])[:slices])


def octahedral_to_sheet(maps: np.ndarray, tiles: Tiles) -> np.ndarray:
    """(nz, ny, nx, T, T, channels) → (rows·ny·T, columns·nx·T, channels)."""
    slices, height, width, cell, _, channels = maps.shape
    flat = maps.transpose(0, 1, 3, 2, 4, 5).reshape(slices, height * cell, width * cell, channels)
    return to_sheet(flat, tiles)


def octahedral_from_sheet(sheet: np.ndarray, resolution, cell: int, tiles: Tiles) -> np.ndarray:
    """The inverse of ``octahedral_to_sheet``. Raises ValueError if the sheet's size is another one."""
    width, height, slices = resolution
    flat = from_sheet(sheet, (width * cell, height * cell, slices), tiles)
    maps = flat.reshape(slices, height, cell, width, cell, sheet.shape[2]).transpose(0, 1, 3, 2, 4, 5)
    return np.ascontiguousarray(maps)
