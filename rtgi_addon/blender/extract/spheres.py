"""Sphere probes: Blender's own Light Probe Sphere objects."""

import numpy as np

from ...scene.sphere_probe import BOX, SPHERE, SphereProbe


def is_sphere(obj) -> bool:
    """True for a Light Probe Sphere object (data type 'SPHERE', 'CUBEMAP' in older files)."""
    return obj.type == "LIGHT_PROBE" and obj.data.type in {"SPHERE", "CUBEMAP", "CUBE"}


def read_sphere(obj, matrix_world) -> SphereProbe:
    """An evaluated Light Probe Sphere as ``SphereProbe``; without custom parallax, it is that of the influence."""
    probe = obj.data
    shape, distance = _shape(probe.influence_type), float(probe.influence_distance)
    custom = bool(probe.use_custom_parallax)
    return SphereProbe(obj.name, np.array(matrix_world, np.float64), shape, distance, float(probe.falloff),
                       _shape(probe.parallax_type) if custom else shape, float(probe.parallax_distance) if custom else distance,
                       float(probe.clip_start), float(probe.clip_end))


def _shape(kind: str) -> str:
    return BOX if kind == "BOX" else SPHERE
