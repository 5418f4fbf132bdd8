"""How lists and volumes lie in textures, as arrays: the shaders' side of it is in include/list.glsl and include/volume.glsl.

Knows no GPU, so that every host of the shaders lays out its textures alike.
"""

import numpy as np

from ..techniques.lpv.geometry_volume import Blocking
from ..techniques.lpv.grid import PER_FLUX, PER_VECTOR
from ..techniques.rsm.gather import GatherMap
from ..transport.virtual_lights import VirtualLights
from .atlas import Atlas

# Wide enough for a GPU, and low enough that a list of millions stays below the largest texture.
FOLD_WIDTH = 4096
# Blocks of a volume's atlas stand in rows of this many (lpv_propagate.comp.glsl).
BLOCK_COLUMNS = 4
# From the coefficients of intensity that arrays hold to the fluxes that propagation works with.
FLUX_SCALE = np.array([1.0 / PER_FLUX, *[1.0 / PER_VECTOR] * 3], np.float32)
# A float holds whole numbers of this many bits exactly.
_BITS = 24
LIGHTS_PER_TEXEL = 4 * _BITS


def fold(rows: np.ndarray) -> np.ndarray:
    """A list (n, c) as texels (h, w, 4), for include/list.glsl: an item takes as many texels as c needs, one after the other, and
    never goes over the end of a row."""
    n, channels = rows.shape
    parts = max(-(-channels // 4), 1)
    per_row = max(min(n, FOLD_WIDTH // parts), 1)
    items = np.zeros((max(-(-n // per_row), 1) * per_row, parts * 4), np.float32)
    items[:n, :channels] = rows
    return items.reshape(-1, per_row * parts, 4)


def unfold(texels: np.ndarray, n: int, channels: int) -> np.ndarray:
    """The first ``n`` items (n, channels ≤ 4) of what ``fold`` made."""
    return np.ascontiguousarray(texels.reshape(-1, 4)[:n, :channels])


def face_blocks(atlas: Atlas, blocking: Blocking) -> tuple[np.ndarray, np.ndarray]:
    """Texels of ``blocking``: a block an axis of transmittances, and two for each of a cell's six faces of what meets a blocker,
    its normal and its albedo."""
    shape = atlas.resolution[::-1]
    faces = [rows.reshape(4, *shape) for rows in blocking.through]
    if blocking.reflectance is None:
        return _blocks(atlas, faces), np.zeros((1, 1, 4), np.float32)
    blockers = []
    for axis in range(3):
        for end in range(2):
            blocked, normal, albedo = (part[axis, end].reshape(-1, *shape)
                                       for part in (blocking.blocked, blocking.normal, blocking.reflectance))
            blockers += [np.stack([*blocked, normal[0], normal[1]]), np.stack([*albedo, normal[2]])]
    return _blocks(atlas, faces), _blocks(atlas, blockers)


def _blocks(atlas: Atlas, volumes: list[np.ndarray]) -> np.ndarray:
    """Volumes (4, nz, ny, nx) as atlases side by side."""
    width, height = atlas.size
    columns, rows = min(len(volumes), BLOCK_COLUMNS), -(-len(volumes) // BLOCK_COLUMNS)
    texels = np.zeros((rows * height, columns * width, 4), np.float32)
    for block, volume in enumerate(volumes):
        x, y = block % BLOCK_COLUMNS * width, block // BLOCK_COLUMNS * height
        texels[y:y + height, x:x + width] = atlas.pack(np.moveaxis(volume, 0, -1))
    return texels


def map_texels(item: GatherMap) -> np.ndarray:
    """What a gather reads of a shadow map's texels, in three blocks side by side (rsm_gather.comp.glsl)."""
    size = item.view.resolution
    return item.rows.reshape(size, size, 3, 4).transpose(0, 2, 1, 3).reshape(size, 3 * size, 4)


def light_rows(lights: VirtualLights) -> np.ndarray:
    """(n, 12) float32: positions, normals and flux/π, four floats each (vpl_gather.comp.glsl)."""
    rows = np.zeros((lights.count, 12), np.float32)
    rows[:, 0:3], rows[:, 4:7], rows[:, 8:11] = lights.positions, lights.normals, lights.flux / np.float32(np.pi)
    return rows


def visibility_bits(visibility: np.ndarray) -> np.ndarray:
    """(n, m) bool as floats (n, 4k) of 24 bits each."""
    n, m = visibility.shape
    words = -(-m // LIGHTS_PER_TEXEL) * 4
    bits = np.zeros((n, words * _BITS), bool)
    bits[:, :m] = visibility
    packed = np.packbits(bits, axis=1, bitorder="little").reshape(n, words, 3).astype(np.uint32)
    return (packed[..., 0] | packed[..., 1] << 8 | packed[..., 2] << 16).astype(np.float32)
