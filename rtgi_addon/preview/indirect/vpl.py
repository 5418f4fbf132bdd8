"""Tables of virtual lights for include/irradiance_vpl.glsl: techniques/vpl/gather.py, ``gather``, with stored visibility.

Short rays are not for a shader: what the bound on the geometry term takes away is not compensated. So the bound is the one that a
bake without compensation has: corners are a little darker, and bright spots are left near edges. The light of lamps themselves is
left out, even if the field has it.
"""

import numpy as np

from ...numerics.sampling import frame, hash_u32
from ...techniques.vpl.field import VplField
from ...transport.rays.tracer import SELF_INTERSECTION
from ..packing import fold, light_rows
from ..uniforms import UniformStruct
from .tables import Tables
from .vpl_shadows import DISTANT_SIDE, DISTANT_TOLERANCE, SIDE, TOLERANCE, SeenPlanes, focus

# Tells the turns of receivers apart from all other numbers: the letters vpl.
_STREAM = 0x76706C
# A bound that no geometry term reaches, as a float holds it.
_NO_CLAMP = np.float32(3e38)
STRUCT = UniformStruct("VirtualLights", (
    ("vec4", "focus"), ("int", "count"), ("int", "distant_count"), ("int", "stride"), ("float", "clamp_at"),
    ("int", "side"), ("int", "distant_side"), ("float", "tolerance"), ("float", "distant_tolerance"),
    ("float", "self_intersection"), ("uint", "seed_state")))


def vpl_tables(field: VplField, samples: int | None = None, seen: SeenPlanes | None = None) -> Tables:
    """The virtual lights of ``field`` and what they see. With ``samples`` a receiver reads about so many of them, those of its own
    turn, for all. ``seen`` remembers for the next field what this one's lights see."""
    lights, context, clamp = field.lights, field.context, field.uncompensated_clamp
    centre, radius = focus(context)
    total = lights.count + lights.distant_count
    stride = 1 if samples is None else max(1, -(-total // samples))
    distant = np.zeros((lights.distant_count, 16), np.float32)
    for column, vectors in enumerate((lights.directions, lights.irradiance, *frame(lights.directions))):
        distant[:, 4 * column:4 * column + 3] = vectors
    values = {"focus": (*centre, radius), "count": lights.count, "distant_count": lights.distant_count, "stride": stride,
              "clamp_at": _NO_CLAMP if clamp is None else clamp, "side": SIDE, "distant_side": DISTANT_SIDE,
              "tolerance": TOLERANCE, "distant_tolerance": DISTANT_TOLERANCE * 2.0 * radius / DISTANT_SIDE,
              "self_intersection": SELF_INTERSECTION, "seed_state": int(hash_u32(_STREAM))}
    seen = seen or SeenPlanes()
    planes = seen.of_lights(context, lights.positions, lights.normals)
    distant_seen = seen.of_distant(context, lights.directions)
    return Tables("indirect_vpl", STRUCT, values, {
        "lights": fold(light_rows(lights)), "distant_lights": fold(distant),
        "planes": fold(planes.reshape(-1, 4)), "distant_planes": fold(distant_seen.reshape(-1, 4))})
