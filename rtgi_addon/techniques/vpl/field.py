"""``VplField``: irradiance anywhere from virtual lights and shadow rays."""

from dataclasses import asdict

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...numerics.sampling import hash_u32, sobol_owen
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.parallel import chunks
from ...transport.rays import offset_origins
from ...transport.sources import Sources
from ..base import Field, ProbeGrid
from ..kernels import NUMPY, Kernels
from ..resample import resample
from .compensation import Compensation
from .gather import gather, gather_sh, visibility
from .incremental import follow
from .sampling import LightSet
from .settings import VplSettings

# Samples of each lamp that has an extent, where direct light is wanted.
LAMP_SAMPLES = 16
# Visibilities, one byte each, that are held at once for a kernel that cannot trace rays.
MAX_VISIBILITIES = 1 << 26


class VplField(Field):
    """The light of ``lights`` (a LightSet) in the scene of ``context``, with geometry terms bounded by ``clamp`` [m⁻²] (None: not
    at all) and ``natural`` [m⁻²] that of ``mean_bound``. ``relight`` follows lamps that moved."""

    technique = "vpl"

    def __init__(self, context: LightContext, lights: LightSet, settings: VplSettings, seed: int, clamp: float | None,
                 natural: float | None, *,
                 kernels: Kernels | None = None):
        self.context, self._set, self._settings, self._seed, self.clamp = context, lights, settings, seed, clamp
        self._natural = natural
        self._kernels = kernels or NUMPY
        self.lights = lights.lights()
        self.includes_direct = settings.direct
        self.params = asdict(settings)
        self.stats = {"lights": self.lights.count, "distant_lights": self.lights.distant_count, "paths": lights.paths.count}
        if clamp is not None:
            self.stats["clamp"] = clamp
        self._compensation = None
        if clamp is not None and settings.compensation:
            self._compensation = Compensation(context, self.lights, clamp, natural, settings.compensation_rays,
                                              settings.bounces, seed)
        self._grids: tuple[ProbeGrid, ...] | None = None

    @property
    def uncompensated_clamp(self) -> float | None:
        """The bound [m⁻²] for whoever gathers without giving back what it takes: a compensated one takes much more."""
        return self.clamp if self._compensation is None else max(self.clamp, self._natural or 0.0)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See Field. Every receiver casts a shadow ray to every virtual light that faces it."""
        points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
        context = self.context
        if self._kernels is NUMPY:
            result = gather(context, self.lights, points, normals, clamp=self.clamp, threads=context.threads)
        else:
            result = self._by_kernel(points, normals)
        if self._compensation is not None:
            result += self._compensation.irradiance(points, normals)
        if self._settings.direct:
            result += self._direct(points, normals)
        return result

    def radiance_sh(self, points: np.ndarray) -> np.ndarray:
        """SH coefficients (n, (order + 1)², 3) float32 of what arrives at free ``points`` (n, 3)."""
        context, settings = self.context, self._settings
        result = gather_sh(context, self.lights, points, settings.order, clamp=self.clamp, threads=context.threads)
        if self._compensation is not None:
            result += self._compensation.coefficients(points, settings.order)
        if settings.direct:
            result += self._direct_sh(points)
        return result

    def arrays(self) -> dict[str, np.ndarray]:
        """The virtual lights, by the names of VirtualLights."""
        return self.lights.arrays()

    def grids(self, progress: Progress | None = None) -> tuple[ProbeGrid, ...]:
        """The field on the scene's volumes, kept once made."""
        if self._grids is None:
            context = self.context
            self._grids = resample(self, context, context.scene.volumes, self._settings.order, progress or Progress(),
                                   seed=self._seed, threads=context.threads, radiance_sh=self.radiance_sh)
        return self._grids

    def relight(self, scene: Scene, progress: Progress | None = None) -> "VplField":
        """This field under the lamps and world of ``scene``: virtual lights that their lamp still lights stay.

        ``stats`` of the result tell the ``replaced_fraction`` of light paths. Raises BakeError if geometry or materials are not
        those of the bake.
        """
        (progress or Progress()).check()
        context = self.context.relit(scene)
        lights, change = follow(self._set, self.context, context, self._settings, self._seed)
        field = VplField(context, lights, self._settings, self._seed, self.clamp, self._natural, kernels=self._kernels)
        field.stats |= {"replaced_paths": change.replaced, "replaced_fraction": change.fraction}
        require_lights(field)
        return field

    def _by_kernel(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """As ``gather``, with the sum over VPLs left to the kernels and visibility found by rays."""
        context, lights = self.context, self.lights
        result = gather(context, lights.take(slice(0, 0)), points, normals, threads=context.threads)
        origins = offset_origins(points, normals, normals)
        for span in chunks(len(points), max(1, MAX_VISIBILITIES // max(lights.count, 1))):
            seen = visibility(context, lights, points[span], normals[span])
            result[span] += self._kernels.vpl_gather(lights, origins[span], normals[span], seen, self.clamp)
        return result

    def _lamp_samples(self):
        """(sources, lamp, number of samples, (2,) numbers) of every sample of every lamp."""
        sources = Sources(self.context)
        for lamp in range(self.context.lamps.count):
            count = 1 if sources.is_delta[lamp] else LAMP_SAMPLES
            for numbers in sobol_owen(count, 2, hash_u32(self._seed, lamp, 6)):
                yield sources, lamp, np.float32(count), numbers

    def _direct(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        result, reach = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
        for sources, lamp, count, numbers in self._lamp_samples():
            result += sources.irradiance(lamp, points, normals, normals, reach, np.tile(numbers, (len(points), 1))) / count
        return result

    def _direct_sh(self, points: np.ndarray) -> np.ndarray:
        order = self._settings.order
        result = np.zeros((len(points), sh.coefficient_count(order), 3), np.float32)
        for sources, lamp, count, numbers in self._lamp_samples():
            directions, irradiance = sources.facing_irradiance(lamp, points, np.tile(numbers, (len(points), 1)))
            result += sh.evaluate(directions, order)[:, :, None] * (irradiance / count)[:, None, :]
        return result


def require_lights(field: VplField) -> None:
    """Raises BakeError if there is light in the scene and none of it left a virtual light."""
    if field.lights.count + field.lights.distant_count or not field.stats["paths"]:
        return
    raise BakeError(f"no virtual light survived: none of {field.stats['paths']} light paths met a surface that reflects",
                    "check that lamps point at visible geometry, that its materials are not black, and that bounces is not 0")
