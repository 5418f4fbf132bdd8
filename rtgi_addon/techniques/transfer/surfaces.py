"""The surfaces that a transfer depends on, as hashes: whether any changed since the bake, and which."""

from collections import defaultdict
from weakref import WeakKeyDictionary

from ...errors import BakeError
from ...scene import Instance, Material, Mesh, Scene
from ...scene.baked import baked_part
from ...scene.content import content_hash
from .columns import materials_of

GEOMETRY, MATERIALS = "geometry", "materials"
# Scenes of more objects are hashed as a whole alone; so many names are said.
_MOST_OBJECTS, _MOST_NAMES = 10_000, 4


def surfaces_of(scene: Scene) -> dict[str, str]:
    """What the transfer of ``scene`` depends on, as hashes by its names: of the whole, and of each object as ``geometry of NAME``
    and ``materials of NAME``."""
    scene = baked_part(scene)
    return {**_whole(scene), **_by_object(scene)}


def require_surfaces(transfer, scene: Scene) -> None:
    """Raises BakeError naming what of ``scene`` is other than when ``transfer`` was baked, and on which objects."""
    scene = baked_part(scene)
    now = _whole(scene)
    changed = [name for name in (GEOMETRY, MATERIALS) if name in transfer.surfaces and now[name] != transfer.surfaces[name]]
    if not changed:
        return
    names = _changed_objects(transfer.surfaces, _by_object(scene), changed)
    remedy = "bake again; transfer follows sun, sky and groups of lights only"
    if not names:
        # Bundles of before do not know objects by themselves.
        raise BakeError(f"the scene's {' and '.join(changed)} changed since the bake", remedy)
    which = ", ".join(names[:_MOST_NAMES] + [f"{len(names) - _MOST_NAMES} more"] * (len(names) > _MOST_NAMES))
    raise BakeError(f"the scene's {' and '.join(changed)} changed since the bake at {which}", remedy)


def _changed_objects(before: dict[str, str], now: dict[str, str], changed: list[str]) -> list[str]:
    """Objects whose hashes differ, in the order of their names, with what came and what is gone marked."""
    if not any(name.startswith(f"{GEOMETRY} of ") for name in before):
        return []
    found = {}
    for kind in changed:
        prefix = f"{kind} of "
        for key in sorted({*before, *now}):
            if key.startswith(prefix) and before.get(key) != now.get(key):
                mark = " (new)" if key not in before else " (gone)" if key not in now else ""
                found.setdefault(key.removeprefix(prefix), mark)
    return [f"{name!r}{mark}" for name, mark in sorted(found.items())]


def _whole(scene: Scene) -> dict[str, str]:
    meshes = [_hash_of(scene.meshes[item.mesh]) for item in scene.instances]
    return {GEOMETRY: content_hash(([_placed(item) for item in scene.instances], meshes)),
            MATERIALS: content_hash([_worn(scene, item) for item in scene.instances])}


def _by_object(scene: Scene) -> dict[str, str]:
    """Hashes of each object of ``scene``, of all that are drawn under its name; none where there are too many."""
    objects = defaultdict(list)
    for item in scene.instances:
        objects[item.name].append(item)
    if len(objects) > _MOST_OBJECTS:
        return {}
    hashes = {}
    for name, items in objects.items():
        hashes[f"{GEOMETRY} of {name}"] = content_hash([(_placed(item), _hash_of(scene.meshes[item.mesh])) for item in items])
        hashes[f"{MATERIALS} of {name}"] = content_hash([_worn(scene, item) for item in items])
    return hashes


def _placed(item: Instance) -> tuple:
    return item.world_from_local, item.visible_diffuse, item.visible_shadow, item.visible_camera, item.visible_scatter


def _worn(scene: Scene, item: Instance) -> list[str]:
    """What ``item`` wears, so that a copy of a material that only shines otherwise counts as the same."""
    return [_hash_of(scene.materials[index]) for _, index in sorted(materials_of(scene, item).items())]


# What meshes and materials hold, as long as these live: both are frozen, and viewports ask at every frame.
_HASHES: WeakKeyDictionary = WeakKeyDictionary()


def _hash_of(part: Mesh | Material) -> str:
    """The hash of a mesh, or of a material but for its emission."""
    if part not in _HASHES:
        _HASHES[part] = content_hash(part.shining(0.0) if isinstance(part, Material) else part)
    return _HASHES[part]
