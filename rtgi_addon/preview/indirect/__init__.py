"""Indirect light in the preview: every technique's irradiance function in GLSL, and how it follows a lamp that moves.

`tables` and a module a technique turn a field into arrays without knowing a GPU; `base` puts them on Blender's. The functions are
`shaders/include/irradiance_*.glsl`, each the twin of its ``Field.irradiance``.
"""

from functools import partial

from ...scene import Scene
from ...techniques.base import Field

# What a receiver reads in a frame that others are averaged with, of a technique that samples: a few dozen frames have more than the
# bake's own settings ask for.
FRAME_SAMPLES = 32


def make_indirect(field: Field | None, scene: Scene, *, samples: int | None = None, live=None):
    """The indirect light (indirect_pass.Indirect) of ``field`` as baked from ``scene``: the technique's own function, or that of
    its probe grids where it has none. Without a field it is what ``live`` captures, the settings of a technique that needs no bake
    (see ``needs_no_bake``), or with None the world's, with nothing in its way.

    ``samples`` replaces the number that a technique which samples reads at each receiver: frames that are averaged need few. GPU
    objects: main thread only.
    """
    # Imported late: hosts without Blender's GPU use the tables of this package.
    from ...techniques.lpv.field import LpvField
    from ...techniques.lpv.settings import LpvSettings
    from ...techniques.probes.field import ProbeField
    from ...techniques.rsm.field import RsmField
    from ...techniques.vpl.field import VplField
    from ..indirect_pass import WorldLight
    from .live_lpv import LpvLight, live_lpv_light
    from .live_rsm import live_rsm_light, rsm_light
    from .probes import probe_tables
    from .relighting import RelitLight
    from .vpl import vpl_tables
    from .vpl_shadows import SeenPlanes
    if field is None:
        if live is None:
            return WorldLight(scene)
        return live_lpv_light(live) if isinstance(live, LpvSettings) else live_rsm_light(live, samples)
    if isinstance(field, ProbeField):
        return RelitLight(field, probe_tables)
    if isinstance(field, LpvField):
        return LpvLight(field)
    if isinstance(field, VplField):
        return RelitLight(field, partial(vpl_tables, samples=samples, seen=SeenPlanes()), includes_direct=False)
    if isinstance(field, RsmField):
        return rsm_light(field, samples)
    return RelitLight(field, grid_tables)


def needs_no_bake(settings) -> bool:
    """True if ``settings`` are those of a technique whose light the preview makes of what it draws."""
    from ...techniques.lpv.settings import LpvSettings
    from ...techniques.rsm.settings import RsmSettings
    return isinstance(settings, LpvSettings) or (isinstance(settings, RsmSettings) and not settings.visibility)


def live_settings(field: Field):
    """The settings of ``field`` if its light is made of what is drawn, so that it follows objects without a bake; else None."""
    from ...techniques.lpv.field import LpvField
    from ...techniques.rsm.field import RsmField
    if isinstance(field, LpvField) and field.bake is not None:
        return field.bake.settings
    if isinstance(field, RsmField) and needs_no_bake(field.capture.settings):
        return field.capture.settings
    return None


def grid_tables(field: Field):
    """Tables of any field resampled to probe grids."""
    from ...techniques.probes.field import ProbeField
    from .probes import probe_tables
    return probe_tables(ProbeField(field.grids(), includes_direct=field.includes_direct))
