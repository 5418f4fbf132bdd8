"""Volumes as 2D textures: Z slices as tiles, columns of tiles from left to right, rows of tiles from bottom to top."""

from dataclasses import dataclass

import numpy as np

from ..errors import BakeError
from ..techniques.base import MAX_TEXTURE_SIDE


@dataclass(frozen=True)
class Atlas:
    """The layout of a volume of ``resolution`` (nx, ny, nz) cells in ``columns`` × ``rows`` tiles of nx × ny texels."""

    resolution: tuple[int, int, int]
    columns: int
    rows: int

    @staticmethod
    def of(resolution, limit: int = MAX_TEXTURE_SIDE) -> "Atlas":
        """The squarest layout. Raises BakeError if a side passes ``limit`` texels."""
        nx, ny, nz = (int(count) for count in resolution)
        columns = min(max(round(float(np.sqrt(nz * ny / nx))), 1), nz)
        atlas = Atlas((nx, ny, nz), columns, -(-nz // columns))
        if max(atlas.size) > limit:
            raise BakeError(f"a volume of {nx} × {ny} × {nz} cells needs a texture of {atlas.size[0]} × {atlas.size[1]}, above "
                            f"the limit of {limit}", "use a lower resolution")
        return atlas

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [texels]."""
        return self.columns * self.resolution[0], self.rows * self.resolution[1]

    def pack(self, volume: np.ndarray) -> np.ndarray:
        """``volume`` (nz, ny, nx, c) as texels (height, width, c); tiles beyond the last slice are zero."""
        nx, ny, nz = self.resolution
        slices = np.zeros((self.rows * self.columns, ny, nx, volume.shape[3]), np.float32)
        slices[:nz] = volume
        tiles = slices.reshape(self.rows, self.columns, ny, nx, -1).transpose(0, 2, 1, 3, 4)
        return np.ascontiguousarray(tiles).reshape(self.rows * ny, self.columns * nx, -1)

    def unpack(self, texels: np.ndarray) -> np.ndarray:
        """The inverse of ``pack``: (nz, ny, nx, c)."""
        nx, ny, nz = self.resolution
        tiles = texels.reshape(self.rows, ny, self.columns, nx, -1).transpose(0, 2, 1, 3, 4)
        return np.ascontiguousarray(tiles.reshape(self.rows * self.columns, ny, nx, -1)[:nz])
