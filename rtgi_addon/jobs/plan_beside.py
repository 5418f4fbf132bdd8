"""What is baked along with a plan and no part of it, and what the planned probes would store as radiance transfer: a line each."""

from ..effects.atlas.bake import wants_atlas
from ..effects.atlas.coefficients import COUNT
from ..effects.atlas.settings import AtlasSettings
from ..effects.atlas.unwrapped import lay_out
from ..effects.spheres.settings import SphereSettings
from ..numerics import dome
from ..scene import Scene
from ..scene.baked import baked_part
from ..techniques.transfer.columns import SUNS, WORLD, group_names
from ..techniques.transfer.data import stored_bytes
from ..techniques.transfer.settings import TransferSettings
from ..transport.surfaces.geometry import flatten

_MIB = 1 << 20
# Vectors of suns that a plan names beside the default.
_FEW_VECTORS = 64
# Numbers of a texel on the disk: coefficients and irradiance of three colours, whether it is known.
_TEXEL = 3 * COUNT + 3 + 1


def beside(scene: Scene, probes: int) -> tuple[str, ...]:
    """The lines for ``scene`` and a plan of so many ``probes``. Raises BakeError for a light atlas that cannot be baked."""
    return (*_spheres(scene), *_atlas(scene), _transfer(scene, probes))


def _spheres(scene: Scene) -> tuple[str, ...]:
    if not scene.spheres:
        return ()
    settings = SphereSettings()
    rays = len(scene.spheres) * int(settings.resolution) ** 2 * settings.rays
    names = ", ".join(probe.name for probe in scene.spheres)
    return (f"Sphere probes are baked beside it ({names}), at their defaults by {rays / 1e6:.2g} million paths: no figure here has "
            "them in it",)


def _atlas(scene: Scene) -> tuple[str, ...]:
    if not wants_atlas(scene):
        return ()
    settings, part = AtlasSettings(), baked_part(scene)
    sheet = lay_out(part, flatten(part), settings)
    height, width = sheet.size
    texels = sum(entry.width * entry.height for entry in sheet.parts)
    return (f"The light atlas is baked beside it, at its defaults {width} x {height} texels by at most "
            f"{texels * settings.rays / 1e6:.2g} million rays, at most {4 * _TEXEL * height * width / _MIB:.2g} MiB on disk: no "
            "figure here has it in it",)


def _transfer(scene: Scene, probes: int) -> str:
    settings, lights = TransferSettings(), len({WORLD, SUNS, *group_names(baked_part(scene))})
    suns = len(dome.directions(settings.sun_side, settings.sun_below))
    each, less = (stored_bytes(settings.order, settings.sky_order, suns, min(settings.sites, probes), lights, settings.half, few)
                  for few in (settings.sun_vectors, _FEW_VECTORS))
    return (f"Radiance transfer (--technique transfer) would store {each / 1000:.1f} kB a probe at its defaults, at most "
            f"{each * probes / _MIB:,.1f} MiB for these ({less / 1000:.1f} kB with --set sun_vectors={_FEW_VECTORS}): they can "
            "then be relit without a bake")
