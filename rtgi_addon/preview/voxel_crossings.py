"""Where lines along the axes meet triangles, by rasterization: the twin of transport/voxels/crossings.py, ``crossings``.

Every pixel of a picture of the triangles along an axis is a line, and every triangle in it a crossing. Agrees crossing by crossing
but where a line meets the edge of a triangle: rasterizers hold corners to a part of a pixel.
"""

import gpu
import numpy as np

from ..errors import BakeError
from ..transport.voxels import crossings as in_numpy
from ..transport.voxels.crossings import TIE, Crossings
from ..transport.voxels.grid import VoxelGrid
from .device import RenderTarget, bind, vertex_buffer
from .packing import FOLD_WIDTH
from .program import Image, Program
from .textures import download, empty
from .uniforms import UniformStruct

# Triangles that a float tells apart; more are left to numpy.
_MOST_TRIANGLES = 1 << 24
# Crossings in a row of their list, of two texels each.
_PER_ROW = FOLD_WIDTH // 2
PROGRAM = Program(
    "voxel_crossings", uniforms=(("parameters", UniformStruct("CrossingParameters", (
        ("ivec3", "resolution"), ("int", "axis"), ("int", "capacity"), ("int", "per_row")))),),
    inputs=(("VEC3", "corner"), ("VEC2", "place"), ("INT", "triangle")), varyings=(("VEC3", "met"),),
    flat_varyings=(("INT", "primitive"),), outputs=(("VEC4", "color"),), defines=(("CROSSING_TIE", repr(TIE)),),
    images=(Image("counter", "R32UI", "READ_WRITE", "UINT_2D_ATOMIC"), Image("crossings")))


def crossings(grid: VoxelGrid, corners: np.ndarray, primitive: np.ndarray, axis: int, lines: int) -> Crossings:
    """See transport.voxels.crossings.crossings. Raises BakeError for more of them than a texture holds."""
    if int(primitive.max(initial=0)) >= _MOST_TRIANGLES:
        return in_numpy.crossings(grid, corners, primitive, axis, lines)
    vertices = {"corner": np.moveaxis(corners, 0, 2).swapaxes(0, 1).reshape(-1, 3).astype(np.float32),
                "place": np.tile(np.float32([[0, 0], [1, 0], [0, 1]]), (len(primitive), 1)),
                "triangle": np.repeat(primitive.astype(np.int32), 3)[:, None]}
    batch = gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer(vertices))
    size = [grid.resolution[(axis + step) % 3] * lines for step in (1, 2)]
    # Drawn to be counted, and once more to be kept.
    count = _drawn(batch, grid, axis, size, empty(2, 1), 0)
    rows = -(-max(count, 1) // _PER_ROW)
    if rows > gpu.capabilities.max_texture_size_get():
        raise BakeError(f"{count:,} places where lines meet triangles are more than a texture of this GPU holds",
                        "use a lower resolution, or --device cpu")
    kept = empty(2 * _PER_ROW, rows)
    _drawn(batch, grid, axis, size, kept, count)
    found = download(kept).reshape(-1, 8)[:count]
    # In numpy's order: rasterizers have none.
    found = found[np.lexsort((found[:, 0], found[:, 1], found[:, 3]))]
    column, row = found[:, 0].astype(np.int64), found[:, 1].astype(np.int64)
    slab, at_column, at_row = np.floor(found[:, 2].astype(np.float64) + TIE).astype(np.int64), column // lines, row // lines
    strides = (1, grid.resolution[0], grid.resolution[0] * grid.resolution[1])
    cell = slab * strides[axis] + at_column * strides[(axis + 1) % 3] + at_row * strides[(axis + 2) % 3]
    line = ((row - at_row * lines) * lines + column - at_column * lines).astype(np.int32)
    return Crossings(axis, cell, line, found[:, 2].copy(), found[:, 3].astype(np.int32),
                     *(np.clip(found[:, 4 + index], 0.0, 1.0) for index in range(2)))


def _drawn(batch, grid: VoxelGrid, axis: int, size, kept, capacity: int) -> int:
    """How many crossings the picture of ``batch`` along ``axis`` has, of which up to ``capacity`` go into ``kept``."""
    counter = gpu.types.GPUTexture((1, 1), format="R32UI")
    counter.clear(format="UINT", value=(0,))
    target = RenderTarget(*size, ("RGBA8",))
    with target.drawing():
        values = {"resolution": grid.resolution, "axis": axis, "capacity": capacity, "per_row": _PER_ROW}
        shader, _alive = bind(PROGRAM, uniforms={"parameters": values}, images={"counter": counter, "crossings": kept})
        batch.draw(shader)
    buffer = counter.read()
    buffer.dimensions = 1
    return int(np.frombuffer(buffer, np.uint32)[0])
