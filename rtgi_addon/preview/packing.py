"""How lists and volumes lie in textures, as arrays: the shaders' side of it is in include/list.glsl and include/volume.glsl.

Knows no GPU, so that every host of the shaders lays out its textures alike.
"""

import numpy as np

from ..techniques.lpv.geometry_volume import Blocking
from ..techniques.lpv.grid import (
    FLUX_OUT,
    LOBE_VECTOR,
    PER_FLUX,
    PER_VECTOR,
    VECTOR_ACROSS,
    VECTOR_AHEAD,
    VECTOR_OF_FLUX,
    VECTOR_OUT,
)
from ..techniques.rsm.gather import GatherMap
from ..techniques.vpl.virtual_lights import VirtualLights
from .atlas import MAX_TEXTURE_SIDE, Atlas

# Wide enough for a GPU, and low enough that a list of millions stays below the largest texture.
FOLD_WIDTH = 4096
# Blocks of a volume's atlas stand in rows of this many (lpv_propagate.comp.glsl).
BLOCK_COLUMNS = 4
# From the coefficients of intensity that arrays hold to the fluxes that propagation works with.
FLUX_SCALE = np.array([1.0 / PER_FLUX, *[1.0 / PER_VECTOR] * 3], np.float32)
# A float holds whole numbers of this many bits exactly: three bytes.
_BITS = 24
LIGHTS_PER_TEXEL = 4 * _BITS


def fold(rows: np.ndarray) -> np.ndarray:
    """A list (n, c) as texels (h, w, 4), for include/list.glsl: an item takes as many texels as c needs, one after the other, and
    never goes over the end of a row."""
    count, channels = rows.shape
    width = max(-(-channels // 4), 1)
    per_row = max(min(count, FOLD_WIDTH // width), 1)
    items = np.zeros((max(-(-count // per_row), 1) * per_row, width * 4), np.float32)
    items[:count, :channels] = rows
    return items.reshape(-1, per_row * width, 4)


def folded(values: np.ndarray) -> np.ndarray:
    """Numbers (n,) as texels (h, w) float32 of one channel, row after row, in a width that keeps them below the largest height."""
    width = FOLD_WIDTH if len(values) <= FOLD_WIDTH * MAX_TEXTURE_SIDE else MAX_TEXTURE_SIDE
    texels = np.zeros(max(-(-len(values) // width), 1) * width, np.float32)
    texels[:len(values)] = values
    return texels.reshape(-1, width)


def instance_switch(chosen: np.ndarray) -> np.ndarray:
    """``chosen`` (i,) bool as texels, for include/instances.glsl: one that stands for all where all are."""
    return fold(np.ones((1, 1)) if chosen.all() else np.asarray(chosen, np.float32)[:, None])


def unfold(texels: np.ndarray, n: int, channels: int) -> np.ndarray:
    """The first ``n`` items (n, channels ≤ 4) of what ``fold`` made."""
    return np.ascontiguousarray(texels.reshape(-1, 4)[:n, :channels])


def face_blocks(atlas: Atlas, blocking: Blocking) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Texels of ``blocking``: ``wall_texels``; two blocks for each of a cell's six faces of what it closes, the surface's normal
    and its albedo; one each of what media keep of flux and of vector flux."""
    shape = atlas.resolution[::-1]
    faces, kept = wall_texels(atlas, blocking.faces, blocking.area), np.zeros((1, 1, 4), np.float32)
    if blocking.kept is not None:
        kept = _blocks(atlas, [np.concatenate([rows, np.zeros_like(rows[:1])]).reshape(4, *shape) for rows in blocking.kept])
    if blocking.reflectance is None:
        return faces, np.zeros((1, 1, 4), np.float32), kept
    blockers = []
    for axis in range(3):
        for end in range(2):
            blocked, normal, albedo = (rows[axis, end].reshape(-1, *shape)
                                       for rows in (blocking.blocked, blocking.normal, blocking.reflectance))
            blockers += [np.stack([*blocked, normal[0], normal[1]]), np.stack([*albedo, normal[2]])]
    return faces, _blocks(atlas, blockers), kept


def step_values(atlas: Atlas, blocking: Blocking) -> dict:
    """Parameters of lpv_propagate.comp.glsl but for ``accumulate``."""
    return {"resolution": atlas.resolution, "columns": atlas.columns, "size": atlas.size,
            "bounces": int(blocking.reflectance is not None), "media": int(blocking.kept is not None),
            "flux_out": FLUX_OUT, "vector_out": VECTOR_OUT,
            "vector_of_flux": blocking.direction * VECTOR_OF_FLUX, "vector_ahead": blocking.direction * VECTOR_AHEAD,
            "vector_across": blocking.direction * VECTOR_ACROSS, "lobe_vector": LOBE_VECTOR}


def wall_texels(atlas: Atlas, faces: np.ndarray | None, area: np.ndarray | None = None) -> np.ndarray:
    """For include/standing.glsl, the ``faces`` (6, nz, ny, nx) of a volume (None: all open) in two halves: what those above a cell
    let through and what ``area`` (N,) multiplies the cell's light by (None: 1), and where the faces are crossed."""
    shape = atlas.resolution[::-1]
    halves = np.zeros((2, 4, *shape), np.float32)
    halves[0] = 1.0
    if faces is not None:
        halves[:, :3] = faces.reshape(2, 3, *shape)
    if area is not None:
        halves[0, 3] = area.reshape(shape)
    return _blocks(atlas, list(halves))


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
    receivers, lights = visibility.shape
    words = -(-lights // LIGHTS_PER_TEXEL) * 4
    bits = np.zeros((receivers, words * _BITS), bool)
    bits[:, :lights] = visibility
    packed = np.packbits(bits, axis=1, bitorder="little").reshape(receivers, words, 3).astype(np.uint32)
    return (packed[..., 0] | packed[..., 1] << 8 | packed[..., 2] << 16).astype(np.float32)
