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


def make_indirect(field: Field | None, scene: Scene, *, samples: int | None = None):
    """The indirect light (indirect_pass.Indirect) of ``field`` as baked from ``scene``: the technique's own function, or that of
    its probe grids where it has none. Without a field it is the world's, with nothing in its way.

    ``samples`` replaces the number that a technique which samples reads at each receiver: frames that are averaged need few. GPU
    objects: main thread only.
    """
    # Imported late: hosts without Blender's GPU use the tables of this package.
    from ...techniques.lpv.field import LpvField
    from ...techniques.probes.field import ProbeField
    from ...techniques.rsm.field import RsmField
    from ...techniques.vpl.field import VplField
    from ..indirect_pass import WorldLight
    from .live_lpv import LpvLight
    from .live_rsm import rsm_light
    from .probes import probe_tables
    from .relighting import RelitLight
    from .vpl import vpl_tables
    from .vpl_shadows import SeenPlanes
    if field is None:
        return WorldLight(scene)
    if isinstance(field, ProbeField):
        return RelitLight(field, probe_tables)
    if isinstance(field, LpvField):
        return LpvLight(field)
    if isinstance(field, VplField):
        return RelitLight(field, partial(vpl_tables, samples=samples, seen=SeenPlanes()), includes_direct=False)
    if isinstance(field, RsmField):
        return rsm_light(field, samples)
    return RelitLight(field, grid_tables)


def grid_tables(field: Field):
    """Tables of any field resampled to probe grids."""
    from ...techniques.probes.field import ProbeField
    from .probes import probe_tables
    return probe_tables(ProbeField(field.grids(), includes_direct=field.includes_direct))
