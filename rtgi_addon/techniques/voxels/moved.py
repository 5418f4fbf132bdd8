"""What has moved since a scene was put into voxels, and the voxels that follow it by what a camera sees."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from ...scene import Scene
from ...scene.scene import STATIC, Instance
from ...transport.context import same_values
from ...transport.voxels.cascades import nested_hierarchies
from ...transport.voxels.hierarchy import Hierarchy
from ...transport.voxels.moving import CameraPoints, with_points, without


class Moved(NamedTuple):
    """Between two scenes: which instances of the later one diffuse rays would meet as the earlier does not know them, ``unknown``
    (i,) bool, and which of the earlier are not there any more as they were, ``gone`` (j,) bool."""

    unknown: np.ndarray
    gone: np.ndarray

    @property
    def any(self) -> bool:
        """Whether there is anything to follow."""
        return bool(self.unknown.any() or self.gone.any())


def moved_since(known: Scene, drawn: Scene) -> Moved:
    """What has moved, come, gone, or changed its mesh or its materials between ``known`` and ``drawn``; instances are the same by
    their names, and one after the other where several have one."""
    before, same = _by_name(known), {}
    unknown, stayed = np.zeros(len(drawn.instances), bool), np.zeros(len(known.instances), bool)
    for (name, turn), index in _by_name(drawn).items():
        instance, other = drawn.instances[index], before.get((name, turn))
        if other is not None and _alike(known, known.instances[other], drawn, instance, same):
            stayed[other] = True
        else:
            unknown[index] = instance.visible_diffuse and instance.bake == STATIC
    return Moved(unknown, ~stayed)


def _by_name(scene: Scene) -> dict[tuple[str, int], int]:
    turns, result = Counter(), {}
    for index, instance in enumerate(scene.instances):
        result[instance.name, turns[instance.name]] = index
        turns[instance.name] += 1
    return result


def _alike(known: Scene, before: Instance, drawn: Scene, after: Instance, same: dict) -> bool:
    """Whether light meets the same in both; ``same`` remembers what was compared of meshes and materials."""
    if not np.array_equal(before.world_from_local, after.world_from_local) or before.visible_diffuse != after.visible_diffuse:
        return False
    if before.bake != after.bake or not _once(same, "mesh", known.meshes, before.mesh, drawn.meshes, after.mesh):
        return False
    if before.material_override == after.material_override and known.materials == drawn.materials:
        return True
    first, second = (_materials(scene, item) for scene, item in ((known, before), (drawn, after)))
    return len(first) == len(second) and all(_once(same, "material", known.materials, a, drawn.materials, b)
                                             for a, b in zip(first, second, strict=True))


def _once(same: dict, kind: str, first: tuple, a: int, second: tuple, b: int) -> bool:
    if first[a] is second[b]:
        return True
    if (kind, a, b) not in same:
        same[kind, a, b] = same_values(first[a], second[b], looks=False)
    return same[kind, a, b]


def _materials(scene: Scene, instance: Instance) -> list[int]:
    override = instance.material_override or {}
    return [override.get(int(index), int(index)) for index in np.unique(scene.meshes[instance.mesh].triangle_material)]


class FollowedVoxels:
    """The voxels of ``field`` (VoxelField) without what is gone by ``moved``, ready to take in what a camera sees of the rest."""

    def __init__(self, field, moved: Moved):
        geometry = field.context.geometry
        self._unknown = moved.unknown
        self._left = [without(voxels, leaving, moved.gone[geometry.instance], geometry)
                      for voxels, leaving in zip(field.cascades, field.leaving, strict=True)]

    def with_points(self, points: CameraPoints | None) -> tuple[Hierarchy, ...]:
        """What receivers in each of their grids read with those of ``points`` (None: none are seen) that are of what has moved."""
        put = None if points is None else points.of(self._unknown)
        return nested_hierarchies([left if put is None else with_points(*left, put) for left in self._left])
