"""The light that a volume is to hold, by Blender's own settings of a Light Probe Volume: Capture and Intensity.

As EEVEE has it (`eevee_lightprobe_volume_load_comp.glsl`), the world's light reaches what stands in a volume whether the volume
captures it or not; Intensity multiplies what was captured, and the world's light with it only if that was.
"""

from dataclasses import replace

from .lights import Light
from .scene import ProbeVolume, Scene


def captured_light(scene: Scene, volume: ProbeVolume) -> Scene:
    """``scene`` with the light that surfaces and media give ``volume``, as strong as it is there; itself where all of it is as it
    is."""
    if volume.captures_all:
        return scene
    materials = scene.materials
    emission = volume.intensity if volume.capture_emission else 0.0
    if emission != 1.0 and any(material.is_emissive for material in materials):
        materials = tuple(material.shining(emission) if material.is_emissive else material for material in materials)
    media = scene.media
    if emission != 1.0 and any(medium.is_emissive for medium in media):
        media = tuple(replace(medium, emission=medium.emission * emission) for medium in media)
    lights = direct_light(scene, volume).lights if volume.capture_bounces else ()
    world = scene.world
    if volume.capture_world and volume.intensity != 1.0:
        world = replace(world, equirect=world.equirect * world.equirect.dtype.type(volume.intensity))
    return replace(scene, materials=materials, lights=lights, world=world, media=media)


def direct_light(scene: Scene, volume: ProbeVolume) -> Scene:
    """``scene`` with its lamps as strong as their direct light is in ``volume``, if it holds that."""
    if volume.intensity == 1.0:
        return scene
    return replace(scene, lights=tuple(_scaled(light, volume.intensity) for light in scene.lights))


def as_it_is(scene: Scene) -> Scene:
    """``scene`` with volumes that capture all light as it is: what techniques are measured by."""
    if all(volume.captures_all for volume in scene.volumes):
        return scene
    volumes = (replace(volume, capture_emission=True, capture_bounces=True, intensity=1.0) for volume in scene.volumes)
    return replace(scene, volumes=tuple(volumes))


def _scaled(light: Light, factor: float) -> Light:
    return replace(light, **{light.STRENGTH: (light.strength * factor).astype("float32")})
