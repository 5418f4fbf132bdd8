"""What a user may set of sphere probes."""

from dataclasses import dataclass

from ...techniques.base import setting

# Texels along a side of the octahedral map.
RESOLUTIONS = ("32", "64", "128", "256")


@dataclass(frozen=True)
class SphereSettings:
    """How sphere probes are baked."""

    bake: bool = setting(True, "Sphere Probes", "Bake what arrives at Light Probe Spheres, for reflections")
    resolution: str = setting("128", "Resolution", "Texels along a side of the map of all directions around a sphere probe",
                              choices=RESOLUTIONS)
    rays: int = setting(16, "Rays per Texel", "Rays from a sphere probe into each texel of its map", "", 1, 1024)
    reflections: int = setting(3, "Reflections", "What a sphere probe sees in mirrors, from mirror to mirror so often", "", 0, 16)


class SphereBake:
    """The settings under their name, for whatever makes options and panels of settings."""

    name, label, Settings = "spheres", "Sphere Probes", SphereSettings


SPHERES = SphereBake()
