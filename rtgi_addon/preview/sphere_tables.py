"""Sphere probes as textures: a row of a table a probe, and the stacks of their maps side by side (include/sphere_probes.glsl)."""

import numpy as np

from ..effects.spheres.maps import LEAST_FALLOFF, LEAST_SIDE, SphereProbes, level_sides
from ..scene.sphere_probe import BOX, SphereProbe

# Texels of a row of the table.
ROWS = 8
# Wide enough for a GPU.
_WIDEST = 8192


def table_row(probe: SphereProbe) -> np.ndarray:
    """(ROWS, 4) float32: what the shaders read of a probe."""
    row = np.zeros((ROWS, 4))
    row[0:3], row[3:6] = probe.unit_from_world[:3], probe.parallax_from_world[:3]
    row[6] = *probe.centre_world, 1.0 / max(probe.falloff, LEAST_FALLOFF)
    row[7, :2] = probe.influence_shape == BOX, probe.parallax_shape == BOX
    return row.astype(np.float32)


def sphere_table(spheres: SphereProbes) -> np.ndarray:
    """(p, ROWS, 4) float32."""
    return np.stack([table_row(item.probe) for item in spheres.maps])


def sphere_atlas(spheres: SphereProbes) -> tuple[np.ndarray, int]:
    """The stacks of all maps (h, w, 4) float32, and how many stand side by side."""
    height, width = spheres.stacks[0].shape[:2]
    columns = max(1, min(len(spheres.stacks), _WIDEST // width))
    rows = -(-len(spheres.stacks) // columns)
    atlas = np.zeros((rows * height, columns * width, 4), np.float32)
    for number, stack in enumerate(spheres.stacks):
        y, x = number // columns * height, number % columns * width
        atlas[y:y + height, x:x + width, :3] = stack
    return atlas, columns


def sphere_defines(spheres: SphereProbes) -> tuple[tuple[str, str], ...]:
    """The compile-time parameters of include/sphere_probes.glsl."""
    return (("RTGI_SPHERES", str(len(spheres.maps))), ("RTGI_SPHERE_SIDE", str(spheres.resolution)),
            ("RTGI_SPHERE_LEVELS", str(len(level_sides(spheres.resolution)))), ("RTGI_SPHERE_LEAST", str(LEAST_SIDE)))
