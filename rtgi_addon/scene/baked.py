"""The part of a scene that takes part in bakes: without objects that only receive light, and without lamps that engines keep."""

from dataclasses import replace

import numpy as np

from .lights import NOT_AT_ALL
from .scene import DYNAMIC, Scene


def baked_part(scene: Scene) -> Scene:
    """``scene`` without dynamic instances and media, and without lamps that are not in the bake at all; ``scene`` itself where it
    has none."""
    kept = np.array([index for index, instance in enumerate(scene.instances) if instance.bake != DYNAMIC], np.intp)
    lights = tuple(light for light in scene.lights if light.bake != NOT_AT_ALL)
    media = tuple(medium for medium in scene.media if medium.bake != DYNAMIC)
    if len(lights) < len(scene.lights) or len(media) < len(scene.media):
        scene = replace(scene, lights=lights, media=media)
    return only_instances(scene, kept)


def only_instances(scene: Scene, kept: np.ndarray) -> Scene:
    """``scene`` with those of its instances alone whose indices are ``kept``; linked lights know them by their new ones."""
    if len(kept) == len(scene.instances):
        return scene
    instances = tuple(_linked(scene.instances[index], kept) for index in kept)
    return replace(scene, instances=instances, lights=tuple(_linked(light, kept) for light in scene.lights))


def _linked(owner, kept: np.ndarray):
    return owner if owner.linking is None else replace(owner, linking=owner.linking.taken(kept))
