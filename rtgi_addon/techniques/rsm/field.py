"""``RsmField``: the first bounce of all lamps, gathered from their reflective shadow maps wherever it is asked for."""

import json
from dataclasses import asdict, dataclass, replace

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.reflective_shadow_map import ReflectiveShadowMap
from ...transport.shadow_views import ShadowView, lit_views, texel_power
from ..base import Field, ProbeGrid, volumes_by_settings
from ..kernels import NUMPY, Kernels
from ..resample import MAX_QUADRATURE_ORDER, resample
from .gather import Pattern, gather, gather_every_texel, gather_sh, prepare
from .settings import RsmSettings

# A texel with what the gather adds to it; maps of all lamps together must stay below the limit [bytes].
TEXEL_BYTES, MAX_BYTES = 96, 4 << 30


def map_views(scene: Scene, bounds: np.ndarray, settings: RsmSettings) -> list[tuple[ShadowView, ...]]:
    """Each lamp's views of ``scene``, whose geometry has ``bounds`` (2, 3); all maps of a lamp together have the texels of one
    square."""
    focus = _focus(scene, bounds, settings.focus)
    views = [lit_views(light, bounds, settings.resolution, lamp, focus=focus, area_points=settings.area_points)
             for lamp, light in enumerate(scene.lights)]
    sides = [max(4, round(settings.resolution / max(len(own), 1) ** 0.5)) for own in views]
    return [tuple(replace(view, resolution=side) for view in own) for own, side in zip(views, sides, strict=True)]


def _focus(scene: Scene, bounds: np.ndarray, scale: float) -> np.ndarray | None:
    """The box (2, 3) that a sun's map must cover: around all volumes, ``scale`` times as large, cut to the scene."""
    cube = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = np.concatenate([cube @ np.asarray(volume.world_from_local)[:3, :3].T + np.asarray(volume.world_from_local)[:3, 3]
                              for volume in scene.volumes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    grown = 0.5 * (low + high) + 0.5 * scale * np.array([low - high, high - low])
    cut = np.stack([np.maximum(grown[0], bounds[0]), np.minimum(grown[1], bounds[1])])
    return cut if np.all(cut[0] <= cut[1]) else None


class LampMaps:
    """The maps of all lamps under one set of settings, and the gather from them: ``prepared`` are those that hold light, read by
    ``pattern``."""

    def __init__(self, context: LightContext, settings: RsmSettings, maps: tuple[ReflectiveShadowMap, ...], seed: int,
                 kernels: Kernels):
        self.context, self.settings, self.maps, self._kernels = context, settings, maps, kernels
        self.prepared = prepare(maps, settings.samples)
        self.pattern = Pattern(settings.samples, settings.disk_radius, settings.disk_share, seed)
        self._tracer = context.tracer if settings.visibility else None

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 3) float32 [W·m⁻²]."""
        if self.settings.every_texel:
            return gather_every_texel(self.prepared, points, normals, tracer=self._tracer, threads=self.context.threads)
        if self._on_device:
            return self._kernels.rsm_gather(self.prepared, points, normals, self.pattern)
        return gather(self.prepared, points, normals, self.pattern, tracer=self._tracer, threads=self.context.threads)

    def radiance_sh(self, progress: Progress):
        """SH of incident radiance as ``resample`` takes it; None where a device that knows irradiance alone is to do the work.
        ``progress`` is asked for the wish to stop only."""
        if self._on_device and self.settings.order <= MAX_QUADRATURE_ORDER:
            return None
        options = {"tracer": self._tracer, "threads": self.context.threads, "progress": progress}
        if self.settings.every_texel:
            return lambda points: gather_every_texel(self.prepared, points, None, order=self.settings.order, **options)
        return lambda points: gather_sh(self.prepared, points, self.settings.order, self.pattern, **options)

    @property
    def _on_device(self) -> bool:
        """The paper's gather runs on the kernels' device; shadow rays and the sum over every texel stay on the CPU."""
        return self._kernels is not NUMPY and self._tracer is None and not self.settings.every_texel


@dataclass(frozen=True, eq=False)
class Capture:
    """What it takes to capture a scene's lamps again: the same ``seed`` and ``kernels``, and ``settings`` of the whole bake."""

    context: LightContext
    settings: RsmSettings
    seed: int
    kernels: Kernels

    def field(self, progress: Progress) -> "RsmField":
        """Capture the lamps, gather at every probe. Raises BakeError where no lamp lights anything."""
        groups = volumes_by_settings(self.context.scene.volumes, self.settings)
        all_settings = dict.fromkeys([self.settings, *(own for own, _ in groups)])
        progress.stage("reflective shadow maps")
        maps, captures = {}, {}
        for number, own in enumerate(all_settings):
            # Only these settings change what is captured.
            key = own.resolution, own.area_points, own.focus
            if key not in captures:
                span = progress.span(0.3 * number / len(all_settings), 0.3 * (number + 1) / len(all_settings))
                captures[key] = self._capture(own, span)
            maps[own] = LampMaps(self.context, own, captures[key], self.seed, self.kernels)
        field = RsmField(self, maps[self.settings])
        progress.stage("gather")
        grids: dict[int, ProbeGrid] = {}
        for number, (own, volumes) in enumerate(groups):
            span = progress.span(0.3 + 0.7 * number / len(groups), 0.3 + 0.7 * (number + 1) / len(groups))
            own_field = field if own == self.settings else RsmField(self, maps[own])
            made = resample(own_field, self.context, volumes, own.order, span, seed=self.seed, threads=self.context.threads,
                            radiance_sh=maps[own].radiance_sh(span))
            grids |= {id(grid.volume): grid for grid in made}
        return RsmField(self, maps[self.settings], tuple(grids[id(volume)] for volume in self.context.scene.volumes))

    def _capture(self, settings: RsmSettings, progress: Progress) -> tuple[ReflectiveShadowMap, ...]:
        scene, bounds = self.context.scene, np.array(self.context.geometry.bounds(), np.float64)
        lights, views = scene.lights, map_views(scene, bounds, settings)
        able = sum(1 for own in views if own)
        if able == 0:
            raise BakeError("the scene has no lamp with any power to capture a reflective shadow map from",
                            "add a sun, point, spot or area lamp, or choose a technique that knows world and emissive surfaces")
        size = able * settings.resolution**2 * TEXEL_BYTES
        if size > MAX_BYTES:
            raise BakeError(f"the maps of {able} lamps with {settings.resolution}² texels each take {size / 2**30:.1f} GiB",
                            f"set a resolution of at most {int((MAX_BYTES / able / TEXEL_BYTES) ** 0.5)}")
        maps = []
        for lamp, own in enumerate(views):
            progress.step(lamp / len(views), "capturing reflective shadow maps")
            maps += [self.kernels.capture(self.context, view) for view in own]
        if not any(_reaches(lights[item.view.lamp], item) for item in maps):
            names = ", ".join(repr(light.name) for light in lights)
            raise BakeError(f"no surface is lit by {names}", "move the lamps to where they light something, or turn them to it")
        return tuple(maps)


class RsmField(Field):
    """The first bounce of all lamps of a scene, and nothing else.

    ``maps`` are its reflective shadow maps. The field keeps what ``capture`` needs to be relit, and to test visibility if it does.
    """

    technique = "rsm"

    def __init__(self, capture: Capture, lamp_maps: LampMaps, grids: tuple[ProbeGrid, ...] = ()):
        self.capture, self._lamp_maps, self._grids = capture, lamp_maps, grids
        self.params = {**asdict(capture.settings), "bounces": 1, "light": "lamps"}
        maps, lights = lamp_maps.maps, capture.context.scene.lights
        dark = [light.name for lamp, light in enumerate(lights)
                if not any(_reaches(light, item) for item in maps if item.view.lamp == lamp)]
        self.stats = {"rays": int(sum(item.primitive.size for item in maps)), "maps": len(maps), "unlit_lamps": dark,
                      "reflected_flux": [float(value) for value in sum(item.total_flux for item in maps)]}
        self.notes = tuple(_notes(capture.context, capture.settings, dark))

    @property
    def maps(self) -> tuple[ReflectiveShadowMap, ...]:
        """The maps of all lamps, lamp after lamp."""
        return self._lamp_maps.maps

    @property
    def pattern(self) -> Pattern:
        """How receivers choose texels."""
        return self._lamp_maps.pattern

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float32 [W·m⁻²] at ``points`` (n, 3) with unit ``normals`` (n, 3), world space; never negative."""
        return self._lamp_maps.irradiance(np.asarray(points, np.float32), np.asarray(normals, np.float32))

    def grids(self) -> tuple[ProbeGrid, ...]:
        """One grid per volume of the scene."""
        return self._grids

    def relight(self, scene: Scene, progress: Progress | None = None) -> "RsmField":
        """This field under the lamps of ``scene``: maps are captured and gathered anew, the ray tracer is kept.

        Raises BakeError if geometry or materials are not those of the bake, or no lamp lights anything.
        """
        return replace(self.capture, context=self.capture.context.relit(scene)).field(progress or Progress())

    def arrays(self) -> dict[str, np.ndarray]:
        """Every map's arrays, and its view as JSON text."""
        arrays = {}
        for number, item in enumerate(self.maps):
            view = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(item.view).items()}
            arrays[f"map{number}.view"] = np.array(json.dumps(view))
            for name in ("position", "normal", "flux", "primitive"):
                arrays[f"map{number}.{name}"] = getattr(item, name)
        return arrays


def _reaches(light, shadow_map: ReflectiveShadowMap) -> bool:
    """True if any light of the lamp meets a surface in this map, whatever that reflects."""
    lit = np.any(texel_power(light, shadow_map.view) > 0, axis=-1)
    return bool(np.any(lit & (shadow_map.primitive >= 0)))


def _notes(context: LightContext, settings: RsmSettings, dark: list[str]):
    yield "rsm holds the first bounce of lamps only" + ("" if settings.visibility else ", without shadows on the bounced light")
    left_out = [what for what, there in (("the world", not context.environment.is_black),
                                         ("emissive surfaces", context.emitters.count > 0)) if there]
    if left_out:
        yield f"rsm leaves out the light of {' and '.join(left_out)}"
    if dark:
        yield f"no surface is lit by {', '.join(map(repr, dark))}"
    shadowless = [light.name for light in context.scene.lights if not light.casts_shadow]
    if shadowless:
        yield f"rsm lets {', '.join(map(repr, shadowless))} cast shadows: a map holds the nearest surface only"
