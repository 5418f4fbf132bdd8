"""``VplField``: irradiance anywhere from virtual lights and shadow rays."""

from dataclasses import asdict
from functools import partial

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.parallel import chunks
from ...transport.rays.tracer import offset_origins
from ..base import Field, ProbeGrid, all_captured
from ..kernels import NUMPY, Kernels
from ..lamp_light import LampLight
from ..lattice.resample import resample
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
        self._lamp_light = LampLight(context, settings.direct, LAMP_SAMPLES, seed)
        self.direct_lamps = self._lamp_light.names
        self.omissions = all_captured("vpl", context.scene.volumes)
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
        # A kernel knows which lights are seen, not through which colours.
        if self._kernels is NUMPY or context.surfaces.has_tint:
            result = gather(context, self.lights, points, normals, clamp=self.clamp, threads=context.threads)
        else:
            result = self._by_kernel(points, normals)
        if self._compensation is not None:
            result += self._compensation.irradiance(points, normals)
        if self._lamp_light:
            result += self._lamp_light.irradiance(points, normals)
        return result

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field; any ``order``."""
        points, context = np.asarray(points, np.float32), self.context
        result = gather_sh(context, self.lights, points, order, clamp=self.clamp, threads=context.threads)
        if self._compensation is not None:
            result += self._compensation.coefficients(points, order)
        if self._lamp_light:
            result += self._lamp_light.coefficients(points, order)
        return result

    def arrays(self) -> dict[str, np.ndarray]:
        """The virtual lights, by the names of VirtualLights."""
        return self.lights.arrays()

    def grids(self, progress: Progress | None = None) -> tuple[ProbeGrid, ...]:
        """The field on the scene's volumes, kept once made."""
        if self._grids is None:
            context = self.context
            self._grids = resample(self, context, context.scene.volumes, self._settings.order, progress or Progress(),
                                   seed=self._seed, threads=context.threads,
                                   radiance_sh=partial(self.radiance_sh, order=self._settings.order))
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


def require_lights(field: VplField) -> None:
    """Raises BakeError if there is light in the scene and none of it left a virtual light."""
    if field.lights.count + field.lights.distant_count or not field.stats["paths"]:
        return
    raise BakeError(f"no virtual light survived: none of {field.stats['paths']} light paths met a surface that reflects",
                    "check that lamps point at visible geometry, that its materials are not black, and that bounces is not 0")
