"""Light propagation volumes that follow lamps without leaving the GPU: shadow maps are drawn, injected and propagated there.

What lamps do not change is uploaded once: what blocks and reflects, the light of emissive surfaces, the world's traced light and
what surfaces send back of it.
"""

from collections.abc import Mapping

import gpu
import numpy as np

from ...techniques.kernels import NUMPY
from ...techniques.lpv import sources
from ...techniques.lpv.bake import LpvBake, reflected
from ...techniques.lpv.grid import LOBE_VECTOR, LpvGrid
from ...techniques.lpv.injection import INJECTION_CELLS
from ..capture import CapturedTextures, Drawn, draw_capture
from ..device import RenderTarget, bind, dispatch, uniform_buffer, vertex_buffer
from ..light_volume import FaceTextures, LightTextures, propagate_light, upload_light
from ..packing import FLUX_SCALE
from ..programs import LPV_INJECT_MAP, LPV_STORE, lpv_cascades, lpv_inject_border
from ..textures import empty, upload
from .lpv import CHANNELS, Stack, lpv_values, stacked_walls


class LiveVolumes:
    """The cascades of ``bake`` with their light on the GPU: ``textures`` by sampler name, for include/irradiance_lpv.glsl.

    ``world`` holds the part of each cascade that the world's traced light is.
    """

    def __init__(self, bake: LpvBake, world: tuple[np.ndarray, ...]):
        self._bake, self._grids, self._stack = bake, bake.grids, Stack(bake.grids)
        emissive = sources.emissive_lights(bake.context, bake.seed)
        self._cascades = []
        for grid, blocking, seen, atlas in zip(bake.grids, bake.blocking, world, self._stack.atlases, strict=True):
            steady = NUMPY.lpv_inject(grid, *emissive, blocking.faces)
            if seen.any() and blocking.reflectance is not None:
                steady = steady + reflected(seen, blocking, NUMPY, bake.context.threads)
            self._cascades.append((FaceTextures(grid.resolution, blocking), upload_light(steady, atlas, FLUX_SCALE),
                                   upload_light(seen, atlas)))
        self._walls = upload(stacked_walls(self._stack, tuple(blocking.faces for blocking in bake.blocking)))
        self._borders = [_border(grid) for grid in bake.grids[:-1]]
        self._uniforms = uniform_buffer(lpv_cascades(len(bake.grids)), lpv_values(bake.grids, self._stack, False))
        self._texels: dict[int, gpu.types.GPUBatch] = {}
        self._stored = tuple(empty(*self._stack.size) for _ in CHANNELS)
        # Without the world's part, which a coarser cascade does not send on: each finer one has its own.
        self._propagated = tuple(empty(*self._stack.size) for _ in CHANNELS) if self._borders else ()

    @property
    def textures(self) -> dict[str, gpu.types.GPUTexture]:
        """The atlases of all cascades, a colour channel each, and of their walls."""
        return {**_named("light", self._stored), "walls": self._walls}

    def light(self, drawn: Drawn) -> None:
        """Fill the volumes with what the lamps of ``drawn`` light. Its world is the bake's; where its objects are not, light falls
        on them where they are, and is blocked and reflected where they were."""
        views = sources.map_views(drawn.scene, drawn.bounds, self._grids, self._bake.settings.map_resolution)
        maps = [draw_capture(drawn, view) for of_lamp in views for view in of_lamp]
        for level in reversed(range(len(self._grids))):
            atlas, (faces, steady, world) = self._stack.atlases[level], self._cascades[level]
            injected = self._inject(level, maps)
            light = tuple(empty(*atlas.size) for _ in CHANNELS)
            _store(injected, steady, light, 1.0, atlas.size, 0)
            total = propagate_light(light, faces, self._bake.settings.steps)
            if self._propagated:
                unlit = (empty(1, 1),) * 3
                _store(total, unlit, self._propagated, 1.0 / FLUX_SCALE, atlas.size, self._stack.rows[level])
            _store(total, world, self._stored, 1.0 / FLUX_SCALE, atlas.size, self._stack.rows[level])

    def _inject(self, level: int, maps: list[CapturedTextures]) -> LightTextures:
        """Fluxes of what ``maps`` reflect into a cascade, and of what the coarser ones send through its border."""
        grid, atlas = self._grids[level], self._stack.atlases[level]
        values = {"resolution": grid.resolution, "columns": atlas.columns, "size": atlas.size, "per_flux": 1.0,
                  "per_vector": LOBE_VECTOR, "corner": grid.corner, "cell": grid.cell, "level": level, "distance": INJECTION_CELLS}
        level_walls = {"level_walls": self._cascades[level][0].faces}
        target = RenderTarget(*atlas.size, ("RGBA32F",) * 3)
        with target.drawing(blend="ADDITIVE_PREMULT"):
            gpu.state.program_point_size_set(True)
            for item in maps:
                samplers = {"map_position": item.position, "map_normal": item.normal, "map_flux": item.flux, **level_walls}
                shader, _alive = bind(LPV_INJECT_MAP, uniforms={"parameters": values}, samplers=samplers)
                self._points(item.view.resolution**2).draw(shader)
            if level < len(self._borders):
                samplers = {**_named("light", self._propagated), "walls": self._walls, **level_walls}
                shader, _alive = bind(lpv_inject_border(len(self._grids)), samplers=samplers,
                                      uniforms={"parameters": values, "indirect": self._uniforms})
                self._borders[level].draw(shader)
            gpu.state.program_point_size_set(False)
        return target.colors

    def _points(self, count: int) -> gpu.types.GPUBatch:
        if count not in self._texels:
            numbers = vertex_buffer({"texel": np.arange(count, dtype=np.int32)[:, None]})
            self._texels[count] = gpu.types.GPUBatch(type="POINTS", buf=numbers)
        return self._texels[count]


def _border(grid: LpvGrid) -> gpu.types.GPUBatch:
    """The lights of a cascade's border as points, without the irradiance that comes through its faces."""
    positions, inward = sources.border(grid)
    lights = sources.entering(grid, positions, inward, np.full_like(positions, grid.cell**2))
    onward = len(lights.flux) // len(positions)
    return gpu.types.GPUBatch(type="POINTS", buf=vertex_buffer({
        "face_position": np.tile(positions, (onward, 1)), "inward": np.tile(inward, (onward, 1)),
        "cell_position": np.asarray(grid.cells_of(lights.positions), np.float32), "normal": lights.normals,
        "share": lights.flux[:, :1]}))


def _named(kind: str, light: LightTextures) -> Mapping[str, gpu.types.GPUTexture]:
    return {f"{kind}_{name}": texture for name, texture in zip(CHANNELS, light, strict=True)}


def _store(light: LightTextures, added: LightTextures, into: LightTextures, scale, size: tuple[int, int], row: int) -> None:
    dispatch(LPV_STORE, size, samplers={**_named("light", light), **_named("added", added)}, images=_named("stored", into),
             uniforms={"parameters": {"scale": np.broadcast_to(scale, 4), "size": size, "first_texel": (0, row)}})
