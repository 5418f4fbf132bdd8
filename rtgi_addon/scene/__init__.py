"""The frozen scene description (rank 1): plain arrays, no Blender."""

from .lights import AreaLight, Light, PointLight, SpotLight, SunLight
from .material import Channel, Material, Texture
from .scene import Camera, Instance, Mesh, ProbeVolume, Scene, World

__all__ = [
    "AreaLight", "Camera", "Channel", "Instance", "Light", "Material", "Mesh", "PointLight", "ProbeVolume", "Scene",
    "SpotLight", "SunLight", "Texture", "World",
]
