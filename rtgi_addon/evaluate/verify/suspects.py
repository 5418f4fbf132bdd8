"""What may make the difference, and the scene in which it cannot.

A suspect is left out or replaced by something so plain that both renderers surely agree on it, in both. If they agree then, it was
the one. Replacing keeps light in the scene, so that there is something left to compare.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics.sampling import fibonacci_sphere
from ...scene import Channel, Light, Material, Omission, Scene, World, only_instances
from ...transport.context import LightContext
from ...transport.lights.kinds import kind_of
from ...transport.paths.reference import trace_radiance
from ...transport.vectors import luminance

OBJECT, LAMP, MATERIAL, WORLD = "object", "lamp", "material", "world"
# The albedo of the surface that stands for any.
GREY = 0.5
# Rays from every probe that find out who gives how much light.
_RAYS = 512


@dataclass(frozen=True)
class Suspect:
    """``kind`` is OBJECT (left out), LAMP (replaced by a bare point, or a sun without a disk), MATERIAL (by a grey diffuse surface
    that does not shine) or WORLD (by its mean colour); ``name`` that of Blender's object or material, "" for the world."""

    kind: str
    name: str = ""

    def __str__(self) -> str:
        return self.kind if self.kind == WORLD else f"{self.kind} {self.name}"


def replaced(scene: Scene, suspects) -> Scene:
    """``scene`` with every one of ``suspects`` left out or replaced."""
    named = {kind: {suspect.name for suspect in suspects if suspect.kind == kind} for kind in (OBJECT, LAMP, MATERIAL, WORLD)}
    kept = np.array([index for index, instance in enumerate(scene.instances) if instance.name not in named[OBJECT]], np.intp)
    scene = only_instances(scene, kept)
    return replace(
        scene,
        lights=tuple(replace(kind_of(light).plain(light), bake=light.bake) if light.name in named[LAMP] else light
                     for light in scene.lights if light.name not in named[OBJECT]),
        media=tuple(medium for medium in scene.media if medium.name not in named[OBJECT]),
        materials=tuple(grey(material.name) if material.name in named[MATERIAL] else material for material in scene.materials),
        world=plain_world(scene.world) if named[WORLD] else scene.world)


def leaves_surfaces(scene: Scene, suspects) -> bool:
    """Whether anything is left to compare light on without ``suspects``."""
    left = replaced(scene, suspects)
    return any(len(left.meshes[instance.mesh].triangles) for instance in left.instances)


def plain_world(world: World) -> World:
    """The mean radiance of ``world`` from everywhere."""
    rows = np.cos((np.arange(world.equirect.shape[0]) + 0.5) / world.equirect.shape[0] * np.pi - 0.5 * np.pi)
    return World.constant(np.average(world.equirect.mean(axis=1), axis=0, weights=rows))


def grey(name: str) -> Material:
    """The surface that stands for any."""
    return Material(name, albedo=Channel.of(GREY))


def suspects_of(context: LightContext, probes: np.ndarray, omissions: tuple[Omission, ...],
                seed: int = 0) -> tuple[tuple[Suspect, ...], tuple[Suspect, ...]]:
    """What is known not to be followed; and all others, the likeliest first: the lamps, the world, and objects and materials by the
    light that comes straight from them to the ``probes`` (p, 3)."""
    scene = context.scene
    lamps = {light.name for light in scene.lights}
    known = [Suspect(LAMP if name in lamps else OBJECT, name) for omission in omissions for name in omission.objects]
    known += [Suspect(MATERIAL, name) for omission in omissions for name in omission.materials]
    objects, materials = _givers(context, probes, seed)
    strongest = sorted(scene.lights, key=lambda light: -_gift(light, probes))
    lights = [Suspect(LAMP, light.name) for light in strongest]
    world = [] if scene.world.is_black else [Suspect(WORLD)]
    # Turn by turn, so that each kind is heard before the last of any.
    turns = [queue[turn] for turn in range(max(map(len, (lights, world, objects, materials)), default=0))
             for queue in (lights, world, objects, materials) if turn < len(queue)]
    return tuple(dict.fromkeys(known)), tuple(suspect for suspect in dict.fromkeys(turns) if suspect not in known)


def _givers(context: LightContext, probes: np.ndarray, seed: int) -> tuple[list[Suspect], list[Suspect]]:
    """The objects and the materials that probes see, those first from which most light comes straight to them."""
    scene, geometry = context.scene, context.geometry
    directions = np.tile(fibonacci_sphere(_RAYS).astype(np.float32), (len(probes), 1))
    origins = np.repeat(np.asarray(probes, np.float32), _RAYS, axis=0)
    arriving = luminance(trace_radiance(context, origins, directions, seed=seed)).astype(np.float64)
    hits = context.tracer.intersect(origins, directions).primitive
    rows = np.flatnonzero(hits >= 0)
    by_instance = np.bincount(geometry.instance[hits[rows]], arriving[rows], minlength=len(scene.instances))
    by_material = np.bincount(geometry.material[hits[rows]], arriving[rows], minlength=max(len(scene.materials), 1))

    def ranked(kind, names, light):
        total: dict[str, float] = {}
        for name, given in zip(names, light, strict=False):
            total[name] = total.get(name, 0.0) + float(given)
        return [Suspect(kind, name) for name in sorted(total, key=lambda name: -total[name])]

    return (ranked(OBJECT, [instance.name for instance in scene.instances], by_instance),
            ranked(MATERIAL, [material.name for material in scene.materials], by_material))


def _gift(light: Light, probes: np.ndarray) -> float:
    """About how much a lamp gives the probes, if nothing is in the way."""
    bare = kind_of(light).plain(light)
    if kind_of(bare).is_distant:
        return float(luminance(bare.strength))
    squared = np.sum((np.asarray(probes, np.float64) - bare.position_world) ** 2, axis=1)
    return float(luminance(bare.strength) * np.mean(1.0 / np.maximum(squared, 1e-6)))
