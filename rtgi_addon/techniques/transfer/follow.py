"""Light as it is in a scene, against what was baked: which of the transfer's columns shine how much now.

The bake keeps, by name, how strong each lamp and emissive material was, and a hash of all else about it. What only became stronger,
weaker or of another colour, and by one factor throughout its group, is followed to the digit; suns and sky are followed whatever
they do; a point lamp that is new by the lamp sites. Everything else is refused by name.
"""

from dataclasses import replace

import numpy as np

from ...errors import BakeError
from ...scene import PointLight, Scene
from ...scene.baked import baked_part
from ...scene.content import content_hash
from .columns import OTHER, group_of, is_loose_sun, materials_of
from .data import Transfer
from .lighting import DistantSun, Lighting, NewLamp, coarse

# Strengths that differ by less than this share are the same.
_SAME = 1e-4


def sources_of(scene: Scene) -> dict[str, dict]:
    """What shines in ``scene`` by its names, as JSON-able ``group``, ``strength`` (3,) and ``rest``, the hash of all else; of
    suns in no group, ``rest`` is theirs by name, and they have no group."""
    scene, found = baked_part(scene), {}
    for light in scene.lights:
        rest = replace(light, name="", light_group="", **{light.STRENGTH: np.ones(3)})
        entry = {"strength": light.strength.tolist(), "rest": content_hash(rest)}
        found[f"lamp {light.name}"] = entry if is_loose_sun(light) else {"group": group_of(light), **entry}
    for instance in scene.instances:
        for index in materials_of(scene, instance).values():
            material = scene.materials[index]
            if material.is_emissive:
                strength = np.broadcast_to(np.asarray(material.emission.constant, np.float64), (3,))
                rest = replace(material.emission, constant=np.ones(3))
                found[f"material {material.name} of {instance.name}"] = {
                    "group": group_of(instance), "strength": strength.tolist(),
                    "rest": content_hash((rest, instance.world_from_local))}
    return found


def lighting_in(transfer: Transfer, scene: Scene) -> Lighting:
    """The light of ``scene`` as ``transfer`` takes it. Raises BakeError naming what it cannot follow."""
    part, now = baked_part(scene), sources_of(scene)
    loose = [light for light in part.lights if is_loose_sun(light)]
    before = {name: entry for name, entry in transfer.sources.items() if "group" not in entry}
    after = {name: entry for name, entry in now.items() if "group" not in entry}
    suns = None if before == after else tuple(
        DistantSun(-np.asarray(light.direction_world, np.float64), light.strength) for light in loose)
    groups, lamps = {}, []
    for name in {entry["group"] for entry in transfer.sources.values() if "group" in entry}:
        groups[name] = _factor(name, transfer.sources, now)
    by_name = {f"lamp {light.name}": light for light in part.lights}
    for name, entry in now.items():
        if "group" in entry and name not in transfer.sources and np.any(np.array(entry["strength"]) > 0):
            light = by_name.get(name)
            if not isinstance(light, PointLight):
                raise BakeError(f"{name} came after the bake", "bake again; of new lamps transfer follows those that are points")
            lamps.append(NewLamp(np.asarray(light.position_world, np.float64), 4.0 * np.pi * light.strength))
    world = coarse(part.world)
    before = transfer.world
    same = np.array_equal(world.equirect, before.equirect) and np.allclose(world.map_from_world, before.map_from_world)
    return Lighting(None if same else world, suns, {name: factor for name, factor in groups.items() if np.any(factor != 1.0)},
                    tuple(lamps))


def _factor(group: str, before: dict[str, dict], now: dict[str, dict]) -> np.ndarray:
    """By what (3,) all that shines in ``group`` was multiplied."""
    members = {name: entry for name, entry in before.items() if entry.get("group") == group}
    common = None
    for name, entry in members.items():
        old, other = np.array(entry["strength"]), now.get(name)
        new = np.zeros(3) if other is None else np.array(other["strength"])
        if other is not None and other["rest"] != entry["rest"] and np.any(new > 0):
            raise BakeError(f"{name} changed more than its strength since the bake", "bake again")
        # What was dark in a colour says nothing of it, unless it is no more.
        ratio = np.where(old > 0, new / np.where(old > 0, old, 1.0), np.nan)
        if np.any((old == 0) & (new > 0)):
            raise BakeError(f"{name} shines in colours that it had not when it was baked", "bake it white, and colour its group")
        if common is None:
            common = ratio
        elif np.any(np.abs(ratio - common) > _SAME * np.maximum(np.abs(common), 1e-6)):
            others = "of no light group" if group == OTHER else f"of the light group {group}"
            raise BakeError(f"{name} changed otherwise than the rest {others}", "give it a light group of its own, and bake again")
        common = np.where(np.isnan(common), ratio, common)
    factor = np.ones(3) if common is None else np.where(np.isnan(common), 1.0, common)
    return np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor)
