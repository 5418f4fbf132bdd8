"""Light propagation volumes on the GPU: injection and propagation (techniques/lpv/injection.py, propagation.py).

Light is three textures, one a channel, each a volume's atlas of SH coefficients or fluxes: what stays on the GPU from injection to
the gather while a lamp moves. The array functions at the end are the same with numpy arrays on both sides.
"""

import gpu
import numpy as np

from ..progress import Progress
from ..techniques.lpv.geometry_volume import Blocking
from ..techniques.lpv.grid import LOBE_VECTOR, PER_FLUX, PER_VECTOR, LpvGrid
from ..techniques.lpv.injection import INJECTION_CELLS
from .atlas import Atlas
from .device import RenderTarget, bind, dispatch, uniform_buffer, vertex_buffer
from .packing import BLOCK_COLUMNS, FLUX_SCALE, face_blocks, step_values, wall_texels
from .programs import LPV_INJECT, LPV_PROPAGATE
from .textures import download, empty, upload

_CHANNELS = ("red", "green", "blue")

LightTextures = tuple[gpu.types.GPUTexture, gpu.types.GPUTexture, gpu.types.GPUTexture]


def atlas_of(resolution) -> Atlas:
    """The layout of a volume on this GPU, with room for the blocks of ``FaceTextures``. Raises BakeError for one too large."""
    return Atlas.of(resolution, gpu.capabilities.max_texture_size_get() // BLOCK_COLUMNS)


def inject_lights(grid: LpvGrid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray,
                  faces: np.ndarray | None = None) -> LightTextures:
    """Coefficients of virtual lights as textures: every light is a point, blended additively into its cell's texel. ``faces`` as of
    techniques.lpv.standing."""
    atlas = atlas_of(grid.resolution)
    target = RenderTarget(*atlas.size, ("RGBA32F",) * 3)
    with target.drawing(blend="ADDITIVE_PREMULT"):
        if len(positions):
            # Relative to the volume in double precision: floats hold cells exactly wherever the volume stands.
            vertices = {"cell_position": grid.cells_of(positions), "normal": normals, "flux": flux}
            buffer = vertex_buffer({name: np.asarray(values, np.float32) for name, values in vertices.items()})
            values = {"resolution": grid.resolution, "columns": atlas.columns, "size": atlas.size, "per_flux": PER_FLUX,
                      "per_vector": LOBE_VECTOR * PER_VECTOR, "corner": grid.corner, "cell": grid.cell, "level": 0,
                      "distance": INJECTION_CELLS}
            walls = upload(wall_texels(atlas, faces))
            gpu.state.program_point_size_set(True)
            shader, _alive = bind(LPV_INJECT, uniforms={"parameters": values}, samplers={"level_walls": walls})
            gpu.types.GPUBatch(type="POINTS", buf=buffer).draw(shader)
            gpu.state.program_point_size_set(False)
    return target.colors


class FaceTextures:
    """What the faces between the cells of a volume do to light: a ``Blocking`` as textures of blocks."""

    def __init__(self, resolution: tuple[int, int, int], blocking: Blocking):
        self.atlas = atlas_of(resolution)
        self.step_values = step_values(self.atlas, blocking)
        self.faces, self.blockers, self.kept = (upload(texels) for texels in face_blocks(self.atlas, blocking))


def propagate_light(light: LightTextures, faces: FaceTextures, steps: int, progress: Progress | None = None) -> LightTextures:
    """Accumulated fluxes as new textures: ``light`` (fluxes) and what each of ``steps`` (at least 1) makes of it, summed; ``light``
    is overwritten. Raises Cancelled when asked to stop."""
    atlas = faces.atlas
    current, following, total = light, *(tuple(empty(*atlas.size) for _ in _CHANNELS) for _ in range(2))
    # The first step begins the sum with the light itself.
    struct = LPV_PROPAGATE.uniforms[0][1]
    first, further = (uniform_buffer(struct, {**faces.step_values, "accumulate": accumulate}) for accumulate in (0, 1))
    for step in range(steps):
        if progress is not None:
            progress.step(step / steps, "propagating light")
        samplers = {f"light_{name}": texture for name, texture in zip(_CHANNELS, current, strict=True)}
        images = {f"{kind}_{name}": texture for kind, textures in (("next", following), ("total", total))
                  for name, texture in zip(_CHANNELS, textures, strict=True)}
        dispatch(LPV_PROPAGATE, atlas.size, uniforms={"parameters": further if step else first},
                 samplers={**samplers, "faces": faces.faces, "blockers": faces.blockers, "kept": faces.kept}, images=images)
        current, following = following, current
    return total


def upload_light(coefficients: np.ndarray, atlas: Atlas, scale: np.ndarray | float = 1.0) -> LightTextures:
    """Textures of ``coefficients`` (4, 3, nz, ny, nx), each multiplied by ``scale`` (4,)."""
    return tuple(upload(atlas.pack(np.moveaxis(coefficients[:, channel], 0, -1) * np.asarray(scale, np.float32)))
                 for channel in range(3))


def download_light(light: LightTextures, atlas: Atlas, scale: np.ndarray | float = 1.0) -> np.ndarray:
    """The inverse of ``upload_light``: (4, 3, nz, ny, nx) float32."""
    volumes = [np.moveaxis(atlas.unpack(download(texture)) * np.asarray(scale, np.float32), -1, 0) for texture in light]
    return np.ascontiguousarray(np.stack(volumes, axis=1))


def inject(grid: LpvGrid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray,
           faces: np.ndarray | None = None) -> np.ndarray:
    """See techniques.lpv.injection.inject; sums are in float32."""
    return download_light(inject_lights(grid, positions, normals, flux, faces), atlas_of(grid.resolution))


def propagate(coefficients: np.ndarray, blocking: Blocking, steps: int, *, threads: int | None = None,
              progress: Progress | None = None) -> np.ndarray:
    """See techniques.lpv.propagation.propagate; ``threads`` are the GPU's own."""
    faces = FaceTextures(coefficients.shape[:1:-1], blocking)
    light = upload_light(coefficients, faces.atlas, FLUX_SCALE)
    return download_light(propagate_light(light, faces, steps, progress), faces.atlas, 1.0 / FLUX_SCALE)
