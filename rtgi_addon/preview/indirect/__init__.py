"""Indirect light in the preview: every technique's irradiance function in GLSL, and how it follows a lamp that moves. A technique's
own function comes in as a module that turns its field into `Tables`; one without is shown through its probe grids.

`tables` and a module a technique turn a field into arrays without knowing a GPU; `base` puts them on Blender's. The functions are
`shaders/include/irradiance_*.glsl`, each the twin of its ``Field.irradiance``.
"""

from functools import partial

from ...scene import Scene
from ...techniques.base import Field

# What a receiver reads in a frame that others are averaged with, of a technique that samples: a few dozen frames have more than the
# bake's own settings ask for.
FRAME_SAMPLES = 32
# Techniques whose light crosses media on its way to receivers, which their own functions in GLSL do not follow: where there are
# media they are shown through their probe grids.
_UNDIMMED = frozenset({"vpl"})


def make_indirect(field: Field | None, scene: Scene, *, samples: int | None = None, live=None, near=None):
    """The indirect light (indirect_pass.Indirect) of ``field`` as baked from ``scene``: the technique's own function, or that of
    its probe grids where it has none. Without a field it is what ``live`` captures, the settings of a technique that needs no bake
    (see ``needs_no_bake``), or with None the world's, with nothing in its way.

    ``near`` (a techniques.lattice.near_light.NearLight of ``field``) is what it leaves out of probes' light.
    ``samples`` replaces the number that a technique which samples reads at each receiver: frames that are averaged need few. GPU
    objects: main thread only.
    """
    # Imported late: hosts without Blender's GPU use the tables of this package.
    from ...techniques.lpv.settings import LpvSettings
    from ...techniques.probes.live import LiveSettings
    from ...techniques.voxels.field import VoxelField
    from ...techniques.voxels.settings import VoxelSettings
    from ..indirect_pass import WorldLight
    from .live_lpv import LpvLight, live_lpv_light
    from .live_probes import LiveProbesLight
    from .live_rsm import live_rsm_light, rsm_light
    from .live_voxels import LiveVoxelsLight
    from .probes import grid_tables, probe_tables
    from .relighting import RelitLight
    from .transfer import TransferLight
    from .vpl import vpl_tables
    from .vpl_shadows import SeenPlanes
    if field is None:
        if live is None:
            return WorldLight(scene)
        if isinstance(live, LiveSettings):
            return LiveProbesLight(live, scene)
        if isinstance(live, VoxelSettings):
            return LiveVoxelsLight(live, None, scene, samples)
        return live_lpv_light(live) if isinstance(live, LpvSettings) else live_rsm_light(live, samples)
    makers = {
        "probes": lambda: RelitLight(field, probe_tables if near is None else lambda relit: probe_tables(near.left_of(relit))),
        "lpv": lambda: LpvLight(field),
        "vpl": lambda: RelitLight(field, partial(vpl_tables, samples=samples, seen=SeenPlanes()), holds_direct=False),
        "rsm": lambda: rsm_light(field, samples),
        "transfer": lambda: TransferLight(field, scene),
    }
    if field.technique in _UNDIMMED and scene.media:
        # Their functions in GLSL know nothing of media; probes hold what media leave of the light.
        return RelitLight(field, grid_tables)
    if isinstance(field, VoxelField):
        return LiveVoxelsLight(field.settings, field, scene, samples)
    return makers.get(field.technique, lambda: RelitLight(field, grid_tables))()


def needs_no_bake(settings) -> bool:
    """True if ``settings`` are those of a technique whose light the preview makes of what it draws."""
    return getattr(settings, "live", False)
