"""Lit cells and what they look like from afar: levels of cells twice as large, by direction.

Along an axis two cells of a column lie one behind the other: what passes the first meets the second. So a coarser cell's opacity
along an axis is c₁ + c₂ less what both block, and a face shows the nearer cell and what that leaves of the farther one; the four
columns of a coarser cell lie side by side, and count alike (Crassin et al. 2011, "Interactive Indirect Illumination Using Voxel
Cone Tracing": anisotropic voxels). Both block c₁·c₂ where what is in them knows nothing of each other, as Crassin has it. Solid
surfaces go on from one cell to the next: those block other lines, as far as there are any, c₁ + c₂ - 1; a slanted sheet whose cells
were multiplied would have holes. Faces look out six ways, so a wall that is red on one side and green on the other stays that on
every level.

What fills a cell decides how its opacity is met on a way of d cells along ω. Of anything, the optical depth of crossing the cell
along each axis is τ = -ln(1 - c), and that of the way Σ τₐ·|ωₐ|·d; between cells it is interpolated. A slab lets through what it
does however small the steps are, however they lie, and under whatever angle.

Of a sheet, that is opaque surfaces which lie in one plane, each cell is met in part, and who does not cross the plane in one of
them crosses it in the next. So rays are asked where they cross it, and for cones shares of crossings, |Σ ±cₐ·ωₐ|·d, add up to 1 and
do not multiply; and a sheet shows the side that faces the eye. By axes a slanted wall would let an eighth of all light through, and
show some of its back to whoever looks at its front.

Of what lies in no plane, as where a wall meets a floor, rays are asked as well where they cross what lies across an axis, if all
does that lines along it meet (Voxels.plates). By the way through the cell a floor would end all who come into such a cell above
it: windows and slits would be narrower by up to a cell on each side, and their rooms darker.
"""

from dataclasses import dataclass

import numpy as np

from .grid import FACES, VoxelGrid
from .voxelize import NO_PLATE, Voxels
from .walls import Walls, too_wide

# Optical depth of what lets nothing through: e^-12 is 6 in a million.
OPAQUE = np.float32(12.0)
# Surfaces lie in one plane where the mean square of their normals across it is less than this.
_FLAT = 0.05
# Lines find the area in a cell to about this factor: a plane that is filled but for that is filled.
_FILLED = 1.2
# A plane that cuts off a smaller corner than this, in faces of a cell, is taken to cut this.
_CORNER = 0.02


@dataclass(frozen=True, eq=False)
class Level:
    """Cells of side ``size`` (in the finest level's) in an array of ``shape`` (nz, ny, nx) with an empty layer around it: ``row``
    (nz·ny·nx,) int32 of each in the tables, 0 for empty ones.

    ``depth`` (r, 3) float32 is the optical depth along x, y, z and ``glow`` (6r, 3) float32 that times the radiance that a face
    shows, at 6·row + face (see FACES), of cells that hold anything. ``sheet`` (r, 3) float32 is, of cells that hold a sheet, the
    share of crossings along x, y, z, with the signs of the sheet's normal, and ``shown`` (2r, 3) float32 the radiance of its sides,
    at 2·row for an eye that looks against that normal and 2·row + 1 for one that looks along it. ``adds`` (r,) bool tells cells of
    coarser levels whose surfaces are solid and lie in no plane: from afar these are parts of one surface as well, and ``depth``
    holds shares of crossings. Of the finest level's, ``plane`` (r, 5) float32 holds the unit normal, how far from the cell's centre
    along it the sheet lies, in cells, and how much of the plane in the cell it fills; or, where that is -1, where along x, y and z
    lies all that blocks along it (Voxels.plates). ``wide`` (nz·ny·nx,) bool: where a sample between a cell and the seven up from it
    would mix what walls keep apart (walls.py). The level's corner lies at ``offset`` from the finest's, in its own cells.
    """

    size: int
    shape: tuple[int, int, int]
    row: np.ndarray
    depth: np.ndarray
    glow: np.ndarray
    sheet: np.ndarray
    shown: np.ndarray
    adds: np.ndarray
    plane: np.ndarray | None
    wide: np.ndarray
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def strides(self) -> tuple[int, int, int]:
        """Steps of the index to the next cell along x, y, z."""
        return 1, self.shape[2], self.shape[1] * self.shape[2]


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """``levels`` of ``grid``, finest first. Where nested grids are its levels (cascades.py), ``cascades`` are those, and ``grid``
    the first of them."""

    grid: VoxelGrid
    levels: tuple[Level, ...]
    cascades: tuple[VoxelGrid, ...] = ()

    @property
    def outermost(self) -> VoxelGrid:
        """The grid that all of it lies in."""
        return self.cascades[-1] if self.cascades else self.grid


@dataclass(frozen=True, eq=False)
class _Cells:
    """Cells at ``place`` (m, 3) with ``opacity`` (m, 3) and premultiplied ``radiance`` (m, 6, 3); ``area`` (m,) in faces of a
    finest cell, ``lie`` (m, 6), ``solid`` (m,) and, of the finest alone, ``middle`` (m, 3) and ``plates`` (m, 3) as in Voxels."""

    place: np.ndarray
    opacity: np.ndarray
    radiance: np.ndarray
    area: np.ndarray
    lie: np.ndarray
    solid: np.ndarray
    middle: np.ndarray | None = None
    plates: np.ndarray | None = None


def build_hierarchy(voxels: Voxels, radiance: np.ndarray, levels: int | None = None, afar: bool = False) -> Hierarchy:
    """``levels`` (None: until a single cell is left) of ``voxels`` whose faces show ``radiance`` (m, 6, 3), premultiplied.
    ``afar``: those of ``voxels`` themselves are taken for parts of one surface as coarser ones are, too."""
    place = voxels.place
    area = voxels.area / voxels.grid.cell**2
    cells = _Cells(place, voxels.opacity, radiance, area, voxels.lie, voxels.solid, voxels.middle, voxels.plates)
    shape, size, made = voxels.grid.shape, 1, []
    while True:
        made.append(_level(size, shape, cells, voxels.walls, afar or size > 1))
        if len(made) == levels or max(shape) == 1:
            return Hierarchy(voxels.grid, tuple(made))
        cells, shape, size = _coarser(cells, shape), tuple(-(-count // 2) for count in shape), 2 * size


def _level(size: int, shape, cells: _Cells, walls: Walls, afar: bool) -> Level:
    place, opacity, count = cells.place, cells.opacity, len(cells.place) + 1
    padded = tuple(extent + 2 for extent in shape)
    row = np.zeros(int(np.prod(padded)), np.int32)
    row[((place[:, 2] + 1) * padded[1] + place[:, 1] + 1) * padded[2] + place[:, 0] + 1] = np.arange(1, count)
    normal, flat = planes_of(cells)
    met = np.maximum(opacity, np.finfo(np.float32).tiny)
    depth, glow = np.zeros((count, 3), np.float32), np.zeros((count, FACES, 3), np.float32)
    optical = np.minimum(-np.log(np.maximum(1.0 - opacity, np.exp(-OPAQUE))), OPAQUE)
    adds = cells.solid & ~flat & afar
    depth[1:] = np.where(flat[:, None], 0, np.where(adds[:, None], opacity, optical))
    glow[1:] = cells.radiance * np.repeat(depth[1:] / met, 2, axis=1)[:, :, None]
    sheet, shown = np.zeros((count, 3), np.float32), np.zeros((count, 2, 3), np.float32)
    sheet[1:] = np.where(flat[:, None], np.where(normal < 0, -opacity, opacity), 0)
    # Along the normal one sees low faces of axes that it ascends, and high ones of those that it descends; then the other way
    # about.
    descends, across = (normal < 0).astype(np.int64), np.maximum(opacity.sum(axis=1), np.finfo(np.float32).tiny)[:, None]
    for side, ends in ((1, descends), (0, 1 - descends)):
        faces = cells.radiance[np.arange(count - 1)[:, None], 2 * np.arange(3) + ends]
        shown[1:, side] = faces.sum(axis=1) / across
    plane = None
    if not afar:
        plane = np.zeros((count, 5), np.float32)
        offset = (normal * cells.middle).sum(axis=1)
        plane[1:, :3], plane[1:, 3] = normal, offset
        plane[1:, 4] = np.where(flat, filled(cells.area, normal, offset), 0.0)
        held = 1 + np.flatnonzero(~flat & (cells.plates != NO_PLATE).any(axis=1))
        plane[held, :3], plane[held, 3:] = cells.plates[held - 1], (0.0, -1.0)
    return Level(size, padded, row, depth, glow.reshape(-1, 3), sheet, shown.reshape(-1, 3),
                 np.append(False, adds), plane, too_wide(walls, size, padded))


def filled(area: np.ndarray, normal: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """How much (m,) of the planes with unit ``normal`` (m, 3), ``offset`` (m,) from cells' middles, surfaces of ``area`` (m,), in
    faces of a cell, fill of what lies in the cells."""
    return np.minimum(_FILLED * area / np.maximum(section(normal, offset), _CORNER), 1.0)


def section(normal: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Area (m,) of what planes with unit ``normal`` (m, 3), ``offset`` (m,) from the middle, share with the cube of side 1."""
    # The area is what the volume below the plane grows by: a sum of cubes over the corners (Cha and Hearst 1984), derived once.
    # Planes along an axis are tilted by a little for it.
    a, b, c = np.maximum(np.abs(np.asarray(normal, np.float64)), 1e-3).T
    height, total = np.asarray(offset, np.float64) + 0.5 * (a + b + c), 0.0
    for corner in range(8):
        below = height - (corner & 1) * a - (corner >> 1 & 1) * b - (corner >> 2) * c
        total = total + (1 - 2 * (corner.bit_count() % 2)) * np.maximum(below, 0.0) ** 2
    return total / (2.0 * a * b * c)


def planes_of(cells: "_Cells | Voxels") -> tuple[np.ndarray, np.ndarray]:
    """The normal (m, 3) of the plane that each cell's surfaces lie in best, and whether (m,) bool they lie in it, and are solid."""
    tensor = np.empty((len(cells.lie), 3, 3))
    for index, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))):
        tensor[:, row, column] = tensor[:, column, row] = cells.lie[:, index]
    values, vectors = np.linalg.eigh(tensor)
    return vectors[:, :, 2].astype(np.float32), cells.solid & (values[:, 2] > 1.0 - _FLAT)


def _coarser(cells: _Cells, shape) -> _Cells:
    """The cells twice as large that hold ``cells`` of an array of ``shape``."""
    place, half = cells.place, [-(-count // 2) for count in shape]
    parent = place // 2
    key = (parent[:, 2] * half[1] + parent[:, 1]) * half[2] + parent[:, 0]
    keys, owner = np.unique(key, return_inverse=True)
    # Children by (x, y, z) within the parent; row 0 is an empty cell.
    child = np.zeros((len(keys), 2, 2, 2), np.int64)
    child[owner, place[:, 0] % 2, place[:, 1] % 2, place[:, 2] % 2] = np.arange(1, len(place) + 1)
    opacity = np.concatenate([np.zeros((1, 3), np.float32), cells.opacity])
    radiance = np.concatenate([np.zeros((1, FACES, 3), np.float32), cells.radiance])
    whole = np.append(True, cells.solid)
    coarse, shown = np.empty((len(keys), 3), np.float32), np.empty((len(keys), FACES, 3), np.float32)
    for axis in range(3):
        low, high = (np.take(child, end, axis=1 + axis).reshape(len(keys), 4) for end in (0, 1))
        first, second = opacity[low, axis], opacity[high, axis]
        both = np.where(whole[low] & whole[high], np.maximum(first + second - 1.0, 0.0), first * second)
        coarse[:, axis] = (first + second - both).mean(axis=1)
        for face, near, far, blocked in ((2 * axis, low, high, second), (2 * axis + 1, high, low, first)):
            passed = 1.0 - both / np.maximum(blocked, np.finfo(np.float32).tiny)
            shown[:, face] = (radiance[near, face] + passed[..., None] * radiance[far, face]).mean(axis=1)
    area = np.bincount(owner, cells.area, len(keys))
    lie = np.stack([np.bincount(owner, cells.area * part, len(keys)) for part in cells.lie.T], axis=1)
    solid = np.bincount(owner, ~cells.solid, len(keys)) == 0
    where = np.stack([keys % half[2], keys // half[2] % half[1], keys // (half[2] * half[1])], axis=1)
    return _Cells(where, coarse, shown, area, lie / np.maximum(area, np.finfo(np.float64).tiny)[:, None], solid)
