"""``RsmField``: the first bounce of all lamps, gathered from their reflective shadow maps wherever it is asked for."""

import json
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Omission, Scene
from ...scene.memory import require_memory
from ...transport.context import LightContext
from ...transport.lights.shadow_view import ShadowView
from ...transport.media.tracer import MediaAlone
from ...transport.parallel import thread_count
from ...transport.views.reflective_shadow_map import ReflectiveShadowMap
from ...transport.views.shadow_views import lit_views, texel_power
from ..base import MAX_QUADRATURE_ORDER, Cause, Field, ProbeGrid, all_captured, volumes_by_settings
from ..kernels import NUMPY, Kernels
from ..lamp_light import LampLight
from ..lattice.focus import box_around
from ..lattice.resample import resample, thread_bytes
from ..unfollowed import quoted, surfaces_of_maps
from .gather import PAIRS, Pattern, gather, gather_every_texel, gather_sh, prepare
from .settings import RsmSettings

# A texel with what the gather adds to it; maps of all lamps together must stay below the limit [bytes].
TEXEL_BYTES, MAX_BYTES = 96, 4 << 30
# A pair of a probe and a texel, beside what its thread takes anyhow.
BYTES_PER_PAIR = 90
# The least side of a map that a lamp of many maps gets [texels].
MIN_SIDE = 4
# How far a bake is when all maps are captured.
_CAPTURED = 0.3
# Samples of each lamp that has an extent, where its direct light is wanted.
LAMP_SAMPLES = 16


def map_views(scene: Scene, bounds: np.ndarray, settings: RsmSettings) -> list[tuple[ShadowView, ...]]:
    """Each lamp's views of ``scene``, whose geometry has ``bounds`` (2, 3); all maps of a lamp together have the texels of one
    square."""
    focus = box_around(scene.volumes, settings.focus, bounds)
    views = [lit_views(light, bounds, settings.resolution, lamp, focus=focus, area_points=settings.area_points)
             for lamp, light in enumerate(scene.lights)]
    sides = [max(MIN_SIDE, round(settings.resolution / max(len(of_lamp), 1) ** 0.5)) for of_lamp in views]
    return [tuple(replace(view, resolution=side) for view in of_lamp) for of_lamp, side in zip(views, sides, strict=True)]


class LampMaps:
    """The maps of all lamps under one set of settings, and the gather from them: ``prepared`` are those that hold light, read by
    ``pattern``."""

    def __init__(self, context: LightContext, settings: RsmSettings, maps: tuple[ReflectiveShadowMap, ...], seed: int,
                 kernels: Kernels):
        self.context, self.settings, self.maps, self._kernels = context, settings, maps, kernels
        self.prepared = prepare(maps, settings.samples)
        self.pattern = Pattern(settings.samples, settings.disk_radius, settings.disk_share, seed)
        # Without shadow rays nothing is in the way but media, which take of the light all the same.
        bare = None if context.media.is_empty else MediaAlone(context.media)
        self._tracer = context.tracer if settings.visibility else bare

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 3) float32 [W·m⁻²]."""
        if self.settings.every_texel:
            return gather_every_texel(self.prepared, points, normals, tracer=self._tracer, threads=self.context.threads)
        if self._on_device:
            return self._kernels.rsm_gather(self.prepared, points, normals, self.pattern)
        return gather(self.prepared, points, normals, self.pattern, tracer=self._tracer, threads=self.context.threads)

    @property
    def knows_irradiance_alone(self) -> bool:
        """True where a device does the work that has no more than that."""
        return self._on_device and self.settings.order <= MAX_QUADRATURE_ORDER

    def radiance_sh(self, points: np.ndarray, order: int, progress: Progress) -> np.ndarray:
        """SH coefficients (n, (order + 1)², 3) float32 of what arrives at free ``points`` (n, 3)."""
        options = {"tracer": self._tracer, "threads": self.context.threads, "progress": progress}
        if self.settings.every_texel:
            return gather_every_texel(self.prepared, points, None, order=order, **options)
        return gather_sh(self.prepared, points, order, self.pattern, **options)

    @property
    def _on_device(self) -> bool:
        """The paper's gather runs on the kernels' device; shadow rays, ways through media and the sum over every texel stay on
        the CPU."""
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
        all_settings = dict.fromkeys([self.settings, *(group_settings for group_settings, _ in groups)])
        progress.stage("reflective shadow maps")
        maps, captures, capturing, gathering = {}, {}, progress.span(0.0, _CAPTURED), progress.span(_CAPTURED, 1.0)
        for number, settings in enumerate(all_settings):
            # Only these settings change what is captured.
            key = settings.resolution, settings.area_points, settings.focus
            if key not in captures:
                span = capturing.span(number / len(all_settings), (number + 1) / len(all_settings))
                captures[key] = self._capture(settings, span)
            maps[settings] = LampMaps(self.context, settings, captures[key], self.seed, self.kernels)
        field = RsmField(self, maps[self.settings])
        progress.stage("gather")
        grids: dict[int, ProbeGrid] = {}
        for number, (settings, volumes) in enumerate(groups):
            span = gathering.span(number / len(groups), (number + 1) / len(groups))
            group_field = field if settings == self.settings else RsmField(self, maps[settings])
            made = resample(group_field, self.context, volumes, settings.order, span, seed=self.seed, threads=self.context.threads,
                            radiance_sh=group_field.resampling(span))
            grids |= {id(grid.volume): grid for grid in made}
        return RsmField(self, maps[self.settings], tuple(grids[id(volume)] for volume in self.context.scene.volumes))

    def _capture(self, settings: RsmSettings, progress: Progress) -> tuple[ReflectiveShadowMap, ...]:
        scene, bounds = self.context.scene, np.array(self.context.geometry.bounds(), np.float64)
        lights, views = scene.lights, map_views(scene, bounds, settings)
        able = sum(1 for of_lamp in views if of_lamp)
        if able == 0:
            raise BakeError("the scene has no lamp with any power to capture a reflective shadow map from",
                            "add a sun, point, spot or area lamp, or choose a technique that knows world and emissive surfaces")
        size = able * settings.resolution**2 * TEXEL_BYTES
        if size > MAX_BYTES:
            raise BakeError(f"the maps of {able} lamps with {settings.resolution}² texels each take {size / 2**30:.1f} GiB",
                            f"set a resolution of at most {int((MAX_BYTES / able / TEXEL_BYTES) ** 0.5)}")
        probes = sum(int(np.prod(volume.resolution)) for volume in scene.volumes)
        pairs = min(probes * settings.samples, PAIRS * thread_count(self.context.threads))
        require_memory({"shadow maps": size, "threads": thread_bytes(self.context) + BYTES_PER_PAIR * pairs})
        maps = []
        for lamp, of_lamp in enumerate(views):
            progress.step(lamp / len(views), "capturing reflective shadow maps")
            maps += [self.kernels.capture(self.context, view) for view in of_lamp]
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
        self._lamp_light = LampLight(capture.context, False, LAMP_SAMPLES, capture.seed)
        self.direct_lamps = self._lamp_light.names
        self.stats = {"rays": int(sum(item.primitive.size for item in maps)), "maps": len(maps), "unlit_lamps": dark,
                      "reflected_flux": [float(value) for value in sum(item.total_flux for item in maps)]}
        self.notes = tuple(_notes(capture.context, capture.settings, dark))
        self.omissions = (*_omissions(capture.context), *all_captured("rsm", capture.context.scene.volumes))

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
        points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
        reflected = self._lamp_maps.irradiance(points, normals)
        return reflected + self._lamp_light.irradiance(points, normals) if self._lamp_light else reflected

    def radiance_sh(self, points: np.ndarray, order: int = 2, progress: Progress | None = None) -> np.ndarray:
        """See Field; any ``order``. ``progress`` is asked for the wish to stop only."""
        points = np.asarray(points, np.float32)
        reflected = self._lamp_maps.radiance_sh(points, order, progress or Progress())
        return reflected + self._lamp_light.coefficients(points, order) if self._lamp_light else reflected

    def resampling(self, progress: Progress):
        """SH of incident radiance as ``resample`` takes it; None where irradiance is all there is. ``progress`` as above."""
        if self._lamp_maps.knows_irradiance_alone:
            return None
        return partial(self.radiance_sh, order=self._lamp_maps.settings.order, progress=progress)

    def leak_causes(self, context: LightContext, points: np.ndarray, normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
        """See Field. The paper's gather has no shadows (section 5)."""
        blind = not self.capture.settings.visibility
        return np.full(len(points), Cause.NO_VISIBILITY if blind else Cause.BETWEEN, np.int8)

    @property
    def live_settings(self) -> RsmSettings | None:
        """See Field."""
        return self.capture.settings if self.capture.settings.live else None

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
    if not context.environment.is_black:
        yield "rsm leaves out the light of the world"
    if dark:
        yield f"no surface is lit by {', '.join(map(repr, dark))}"


def _omissions(context: LightContext):
    """What of the scene's lights and surfaces the maps do not follow."""
    emitters = context.geometry.material[context.emitters.primitive]
    names = tuple(dict.fromkeys(context.scene.materials[index].name for index in np.unique(emitters)))
    if names:
        yield Omission(f"rsm leaves out the light that {quoted(names)} gives off", materials=names)
    shadowless = tuple(light.name for light in context.scene.lights if not light.casts_shadow)
    if shadowless:
        yield Omission(f"rsm lets {quoted(shadowless)} cast shadows: a map holds the nearest surface only", objects=shadowless)
    yield from surfaces_of_maps("rsm", context)
