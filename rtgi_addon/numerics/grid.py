"""Cell-centred probe lattices: Blender's Light Probe Volume (docs/physics.md §1).

The volume is the box local [−1, 1]³ under ``world_from_local``; with resolution N along an axis, sample i lies at local
(2i + 1)/N − 1, as in EEVEE. Lattice coordinates count in samples: sample i is at i, the box reaches from −½ to N − ½.
Arrays over a lattice are indexed [z, y, x]; its flat index is (z·ny + y)·nx + x.
"""

import numpy as np

# Bits along an axis of a Z-order code of three.
CURVE_BITS = 21
# Corners of the box [−1, 1]³ that probe volumes are in their own space.
UNIT_BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)


def transform_points(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """``points`` (…, 3) under the affine ``matrix`` (4, 4): float64 (…, 3)."""
    matrix = np.asarray(matrix, np.float64)
    return np.asarray(points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def box_corners(world_from_local: np.ndarray) -> np.ndarray:
    """Corners (8, 3) float64 of a volume in the world."""
    return transform_points(world_from_local, UNIT_BOX)


def local_from_world(world_from_local: np.ndarray, points_world: np.ndarray) -> np.ndarray:
    """Local coordinates (…, 3) float64 of ``points_world`` (…, 3). Raises numpy.linalg.LinAlgError for a singular matrix."""
    return transform_points(np.linalg.inv(np.asarray(world_from_local, np.float64)), points_world)


def lattice_from_local(points_local: np.ndarray, resolution) -> np.ndarray:
    """Lattice coordinates (…, 3) of ``points_local`` (…, 3) for ``resolution`` (x, y, z)."""
    return (np.asarray(points_local) + 1.0) * (0.5 * np.asarray(resolution, np.float64)) - 0.5


def local_from_lattice(points_lattice: np.ndarray, resolution) -> np.ndarray:
    """Local coordinates (…, 3) of ``points_lattice`` (…, 3): the inverse of ``lattice_from_local``."""
    return (2.0 * np.asarray(points_lattice) + 1.0) / np.asarray(resolution, np.float64) - 1.0


def lattice_from_world(world_from_local: np.ndarray, resolution, points_world: np.ndarray) -> np.ndarray:
    """Lattice coordinates (…, 3) float64 of ``points_world`` (…, 3)."""
    return lattice_from_local(local_from_world(world_from_local, points_world), resolution)


def lattice_points(world_from_local: np.ndarray, resolution) -> np.ndarray:
    """World positions (nz, ny, nx, 3) float64 of every sample of the lattice of ``resolution`` (x, y, z)."""
    nx, ny, nz = (int(count) for count in resolution)
    z, y, x = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
    return transform_points(world_from_local, local_from_lattice(np.stack([x, y, z], axis=-1), resolution))


def cell_axes(world_from_local: np.ndarray, resolution) -> np.ndarray:
    """World vectors (3, 3) float64 from one sample to the next: row k along lattice axis k."""
    return np.asarray(world_from_local, np.float64)[:3, :3].T * (2.0 / np.asarray(resolution, np.float64))[:, None]


def cell_size(world_from_local: np.ndarray, resolution) -> np.ndarray:
    """Distance (3,) float64 between neighbouring samples along x, y and z of the lattice [m]."""
    return np.linalg.norm(cell_axes(world_from_local, resolution), axis=1)


def cell_volume(world_from_local: np.ndarray, resolution) -> float:
    """Volume of one cell [m³]."""
    return float(abs(np.linalg.det(cell_axes(world_from_local, resolution))))


def trilinear(points_lattice: np.ndarray, resolution) -> tuple[np.ndarray, np.ndarray]:
    """The eight samples about each of ``points_lattice`` (n, 3): flat indices (n, 8) int64 and weights (n, 8) float32.

    Coordinates are clamped to the outermost samples first, so the weights are never negative and always sum to 1. Along an
    axis with a single sample both neighbours are that sample.
    """
    last = np.asarray(resolution, np.int64) - 1
    clamped = np.clip(np.asarray(points_lattice, np.float64), 0.0, last)
    low = np.minimum(clamped.astype(np.int64), np.maximum(last - 1, 0))
    fraction = (clamped - low).astype(np.float32)
    high = np.minimum(low + 1, last)
    strides = np.array([1, last[0] + 1, (last[0] + 1) * (last[1] + 1)])
    offsets, shares = np.stack([low, high], axis=-1) * strides[:, None], np.stack([1.0 - fraction, fraction], axis=-1)
    corner = np.arange(8)
    bits = np.stack([corner & 1, (corner >> 1) & 1, corner >> 2])
    indices = offsets[:, 0, bits[0]] + offsets[:, 1, bits[1]] + offsets[:, 2, bits[2]]
    weights = shares[:, 0, bits[0]] * shares[:, 1, bits[1]] * shares[:, 2, bits[2]]
    return indices, weights


def z_order(cells: np.ndarray) -> np.ndarray:
    """Codes (n,) uint64 that put ``cells`` (n, d) of a lattice, from 0 to below 2^CURVE_BITS along each of up to three axes, in the
    order of a Z-order curve: what follows one another lies near one another (G. M. Morton, 1966)."""
    code = np.zeros(len(cells), np.uint64)
    for axis in range(cells.shape[1]):
        # Two zeros between every bit and the next.
        spread = cells[:, axis].astype(np.uint64)
        for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F), (4, 0x10C30C30C30C30C3),
                            (2, 0x1249249249249249)):
            spread = (spread | (spread << np.uint64(shift))) & np.uint64(mask)
        code |= spread << np.uint64(axis)
    return code


def box_distance(world_from_local: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) float64: from ``points`` (n, 3) to the point of the box local [−1, 1]³ with the nearest local coordinates [m]; 0
    inside."""
    nearest = transform_points(world_from_local, np.clip(local_from_world(world_from_local, points), -1.0, 1.0))
    return np.linalg.norm(nearest - points, axis=-1)
