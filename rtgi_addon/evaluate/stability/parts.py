"""Parts of the suite's scenes: rooms, walls, panels and lamps in plain arrays, and receivers on a room's walls."""

from dataclasses import fields, replace

import numpy as np

from ...numerics.grid import transform_points
from ...scene import Channel, Instance, Light, Material, Mesh, PointLight, ProbeVolume, Scene, SpotLight, World

_CORNERS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float64)
# Outward-facing, two triangles a side.
_SIDES = np.array([[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
                   [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]], np.int32)
# The corner of the room that most scenes are.
ONE = np.ones(3)
# Receivers keep this share of the room's side from its edges, unless told otherwise.
MARGIN = 0.1
# The seed of path traced references, which is none of the bakes'.
REFERENCE_SEED = 7


def box(name: str, low, high, material: int = 0, inward: bool = False) -> Mesh:
    """A closed axis-aligned box between ``low`` (3,) and ``high`` (3,); ``inward`` makes it a room."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    vertices = 0.5 * (low + high) + 0.5 * (high - low) * _CORNERS
    return mesh(name, vertices, _SIDES[:, ::-1] if inward else _SIDES, material)


def quad(name: str, corner, edge_u, edge_v, material: int = 0) -> Mesh:
    """A parallelogram facing along edge_u × edge_v."""
    corner, u, v = (np.asarray(vector, np.float64) for vector in (corner, edge_u, edge_v))
    return mesh(name, np.stack([corner, corner + u, corner + u + v, corner + v]), [[0, 1, 2], [0, 2, 3]], material)


def sphere(name: str, radius: float, rings: int = 24, inward: bool = True, material: int = 0) -> Mesh:
    """A closed sphere of ``rings`` by twice as many quads, of which each is two triangles."""
    polar = np.pi * np.arange(1, rings) / rings
    azimuth = np.pi * np.arange(2 * rings) / rings
    around = np.stack([np.outer(np.sin(polar), np.cos(azimuth)), np.outer(np.sin(polar), np.sin(azimuth)),
                       np.repeat(np.cos(polar)[:, None], 2 * rings, axis=1)], axis=-1).reshape(-1, 3)
    vertices = radius * np.concatenate([around, [[0, 0, 1], [0, 0, -1]]])
    row, column = (index.ravel() for index in np.meshgrid(np.arange(rings - 2), np.arange(2 * rings), indexing="ij"))
    here, beside = row * 2 * rings + column, row * 2 * rings + (column + 1) % (2 * rings)
    below, across = here + 2 * rings, beside + 2 * rings
    first, second = np.arange(2 * rings), (np.arange(2 * rings) + 1) % (2 * rings)
    last = (rings - 2) * 2 * rings
    triangles = np.concatenate([
        np.stack([here, below, beside], 1), np.stack([beside, below, across], 1),
        np.stack([np.full_like(first, len(around)), first, second], 1),
        np.stack([np.full_like(first, len(around) + 1), last + second, last + first], 1)])
    return mesh(name, vertices, triangles[:, ::-1] if inward else triangles, material)


def mesh(name: str, vertices, triangles, material: int = 0) -> Mesh:
    """A mesh with one material and flat faces."""
    triangles = np.ascontiguousarray(triangles, np.int32)
    return Mesh(name, np.ascontiguousarray(vertices, np.float32), triangles, np.full(len(triangles), material, np.int32))


def grey(albedo=0.5, emission=0.0, name: str = "wall") -> Material:
    """A uniform diffuse material; ``emission`` is radiance."""
    return Material(name, albedo=Channel.of(albedo), emission=Channel.of(emission))


def point(position, intensity=1.0) -> PointLight:
    """A point without size; ``intensity`` [W/sr]."""
    return PointLight("lamp", np.asarray(position, np.float32), np.full(3, intensity, np.float32))


def spot(position, target, intensity=1.0, cone_degrees: float = 60.0) -> SpotLight:
    """A hard-edged spot without size that shines at ``target``."""
    direction = np.asarray(target, np.float64) - position
    return SpotLight("lamp", np.asarray(position, np.float32), (direction / np.linalg.norm(direction)).astype(np.float32),
                     np.full(3, intensity, np.float32), np.radians(cone_degrees))


def volume(low, high, resolution) -> ProbeVolume:
    """A probe volume over the box from ``low`` (3,) to ``high`` (3,)."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    matrix = np.diag([*(0.5 * (high - low)), 1.0])
    matrix[:3, 3] = 0.5 * (low + high)
    return ProbeVolume("volume", matrix, tuple(int(count) for count in resolution))


def scene(name: str, meshes, materials, lights=(), world=0.0, volumes=()) -> Scene:
    """A scene with one unmoved instance of every mesh; ``world`` is a constant radiance."""
    return Scene(name=name, meshes=tuple(meshes), instances=tuple(Instance(m.name, i, np.eye(4)) for i, m in enumerate(meshes)),
                 materials=tuple(materials), lights=tuple(lights), world=World.constant(world), volumes=tuple(volumes))


def rotation(axis, degrees: float) -> np.ndarray:
    """(4, 4) float64: about ``axis`` (3,) through the origin (Rodrigues)."""
    x, y, z = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return matrix


def moved(scene_: Scene, world_from_old: np.ndarray, *, volumes: bool = True, intensity: float = 1.0) -> Scene:
    """``scene_`` under a similarity ``world_from_old`` (4, 4), its probe volumes left behind unless ``volumes``; lamps' intensities
    times ``intensity``."""
    scale = float(np.cbrt(np.linalg.det(world_from_old[:3, :3])))
    def placed(items):
        return tuple(replace(item, world_from_local=world_from_old @ item.world_from_local) for item in items)

    lights = tuple(_moved_light(light, world_from_old, scale, intensity) for light in scene_.lights)
    return replace(scene_, instances=placed(scene_.instances), lights=lights,
                   volumes=placed(scene_.volumes) if volumes else scene_.volumes)


def _moved_light(light: Light, world_from_old: np.ndarray, scale: float, intensity: float) -> Light:
    new: dict = {}
    names = {item.name for item in fields(light)}
    if "position_world" in names:
        new["position_world"] = transform_points(world_from_old, light.position_world[None])[0].astype(np.float32)
    for name in names & {"direction_world", "normal_world"}:
        new[name] = (world_from_old[:3, :3] @ getattr(light, name) / scale).astype(np.float32)
    for name in names & {"half_u_world", "half_v_world"}:
        new[name] = (world_from_old[:3, :3] @ getattr(light, name)).astype(np.float32)
    if "radius" in names:
        new["radius"] = light.radius * scale
    if getattr(light, "world_from_local", None) is not None:
        new["world_from_local"] = world_from_old[:3, :3] @ light.world_from_local / scale
    if "intensity" in names:
        new["intensity"] = light.intensity * np.float32(intensity)
    return replace(light, **new)


def receivers(low, high, side: int = 4, margin: float = MARGIN) -> tuple[np.ndarray, np.ndarray]:
    """Points (6·side², 3) on the six walls of a room from ``low`` to ``high`` and their normals (6·side², 3), inward; float32.

    They form a grid a wall that keeps ``margin`` of its sides from its edges."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    along = margin + (1 - 2 * margin) * (np.arange(side) + 0.5) / side
    across, up = (grid.ravel() for grid in np.meshgrid(along, along))
    points, normals = [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            local = np.empty((side * side, 3))
            local[:, axis], local[:, (axis + 1) % 3], local[:, (axis + 2) % 3] = end, across, up
            points.append(low + local * (high - low))
            normals.append(np.broadcast_to(np.eye(3)[axis] * (1 - 2 * end), local.shape))
    return np.concatenate(points).astype(np.float32), np.concatenate(normals).astype(np.float32)


def turned(points: np.ndarray, normals: np.ndarray, world_from_old: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Receivers under a similarity."""
    scale = np.cbrt(np.linalg.det(world_from_old[:3, :3]))
    return (transform_points(world_from_old, points).astype(np.float32),
            (normals @ world_from_old[:3, :3].T / scale).astype(np.float32))


def brightness(field, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance (n,) float64 by ``field``, averaged over the channels."""
    return np.asarray(field.irradiance(points, normals), np.float64).mean(axis=1)


def rms_change(found: np.ndarray, expected: np.ndarray) -> float:
    """Root mean square of the difference over the mean of what was ``expected``; infinite where that is no number."""
    with np.errstate(divide="ignore", invalid="ignore"):
        value = float(np.sqrt(np.mean((found - expected) ** 2)) / expected.mean())
    return value if np.isfinite(value) else float("inf")


def room_with_block(side: int = 4) -> Scene:
    """A 2 m room with a lamp above a block; a lattice of ``side`` probes a side."""
    return scene("room with a block", [box("room", -ONE, ONE, inward=True), box("block", (-0.1, -0.4, -1.0), (0.6, 0.4, -0.2))],
                 [grey(0.6)], [point((-0.4, -0.3, 0.6), 1.0)], volumes=[volume(-ONE, ONE, (side,) * 3)])
