"""Sphere probes on the GPU, for every program that reads them (include/sphere_textures.glsl)."""

from ..effects.spheres.maps import SphereProbes
from ..techniques.lattice.weights import shader_constants
from .sphere_tables import sphere_atlas, sphere_defines, sphere_table
from .textures import upload

# Members of the struct `spheres` of such a program, and its textures.
MEMBERS = (("ivec2", "stack"), ("int", "columns"))
SAMPLERS = ("sphere_table", "sphere_maps")


def sphere_constants(spheres: SphereProbes) -> tuple[tuple[str, str], ...]:
    """The compile-time parameters of a program that reads ``spheres``."""
    return (*shader_constants().items(), *sphere_defines(spheres))


class SphereTextures:
    """``samplers`` by name, and the ``values`` of MEMBERS. Main thread only."""

    def __init__(self, spheres: SphereProbes):
        atlas, columns = sphere_atlas(spheres)
        height, width = spheres.stacks[0].shape[:2]
        self.values = {"stack": (width, height), "columns": columns}
        self.samplers = {"sphere_table": upload(sphere_table(spheres), name="the table of sphere probes"),
                         "sphere_maps": upload(atlas, "RGBA16F", name="the maps of sphere probes")}
