"""The frozen scene description (rank 1): plain arrays, no Blender.

Whatever extraction reads and light transport needs comes in here as a frozen dataclass, with its check in `checks`.
"""

from .baked import baked_part, only_instances
from .lamp_profile import LampProfile
from .lights import AreaLight, Light, PointLight, SpotLight, SunLight
from .linking import Linking
from .material import Channel, Material, Texture
from .medium import ClosedMesh, DensityGrid, Medium, Phase
from .omission import Omission, Omissions
from .scattered import Scattered
from .scene import Camera, Instance, Mesh, Mist, NearSurfaces, ProbeVolume, Scene, World, drawn_otherwise, seen_by_camera
from .sphere_probe import SphereProbe

__all__ = [
    "AreaLight", "Camera", "Channel", "ClosedMesh", "DensityGrid", "Instance", "LampProfile", "Light", "Linking", "Material",
    "Medium", "Mesh", "Mist", "NearSurfaces", "Omission", "Omissions", "Phase", "PointLight", "ProbeVolume", "Scattered", "Scene",
    "SphereProbe", "SpotLight", "SunLight", "Texture", "World", "baked_part", "drawn_otherwise", "only_instances", "seen_by_camera",
]
