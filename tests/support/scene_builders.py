"""Small scenes in plain numpy whose light has a closed form, and the parts they are made of.

``pythonpath`` in pyproject.toml puts this folder on the path: ``from scene_builders import closed_box``.
"""

import numpy as np

from rtgi_addon.scene import Channel, Instance, Material, Mesh, PointLight, ProbeVolume, Scene, World

CUBE_CORNERS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
# Outward-facing, two triangles a side: −Z, +Z, −Y, +Y, −X, +X.
CUBE_TRIANGLES = np.array([
    [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
    [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
], np.int32)


def material(name="grey", albedo=0.5, emission=0.0):
    """A uniform diffuse material; ``emission`` is radiance [W·sr⁻¹·m⁻²]."""
    return Material(name, albedo=Channel.of(albedo), emission=Channel.of(emission))


def mesh(name, vertices, triangles, material_index=0):
    """A mesh with one material and flat faces."""
    triangles = np.ascontiguousarray(triangles, np.int32)
    return Mesh(name, np.ascontiguousarray(vertices, np.float32), triangles, np.full(len(triangles), material_index, np.int32))


def cube(name="cube", half_size=1.0, inward=False, material_index=0):
    """An axis-aligned cube [−half_size, half_size]³; ``inward`` turns its normals to the inside, as a room's walls are."""
    triangles = CUBE_TRIANGLES[:, ::-1] if inward else CUBE_TRIANGLES
    return mesh(name, CUBE_CORNERS * np.float32(half_size), triangles, material_index)


def plane(name="plane", half_size=1.0, z=0.0, material_index=0):
    """A square in z = ``z``, facing +Z."""
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * np.float32(half_size)
    vertices[:, 2] = z
    return mesh(name, vertices, [[0, 1, 2], [0, 2, 3]], material_index)


def sphere(name="sphere", radius=1.0, subdivisions=3, inward=False, material_index=0):
    """An icosphere of 20·4^subdivisions triangles with its vertices on the sphere."""
    golden = (1.0 + 5.0**0.5) / 2.0
    vertices = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0], [0, -1, golden], [0, 1, golden],
                         [0, -1, -golden], [0, 1, -golden], [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]])
    triangles = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
                          [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11],
                          [6, 2, 10], [8, 6, 7], [9, 8, 1]])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(subdivisions):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = vertices[unique].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        m = inverse.reshape(-1, 3) + len(vertices)
        a, b, c = triangles.T
        triangles = np.concatenate([np.stack(corners, 1) for corners in (
            (a, m[:, 0], m[:, 2]), (b, m[:, 1], m[:, 0]), (c, m[:, 2], m[:, 1]), (m[:, 0], m[:, 1], m[:, 2]))])
        vertices = np.concatenate([vertices, middle])
    return mesh(name, vertices * radius, triangles[:, ::-1] if inward else triangles, material_index)


def transform(translation=(0.0, 0.0, 0.0), scale=(1.0, 1.0, 1.0), rotation=None):
    """A (4, 4) float64 world_from_local: scale, then rotation (3, 3), then translation."""
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if rotation is None else rotation) @ np.diag(np.broadcast_to(scale, 3).astype(float))
    matrix[:3, 3] = translation
    return matrix


def volume(name="volume", resolution=(2, 2, 2), half_size=0.5, center=(0.0, 0.0, 0.0)):
    """An axis-aligned probe volume; ``half_size`` is a scalar or one number an axis."""
    return ProbeVolume(name, transform(center, half_size), tuple(resolution))


def scene(meshes, materials=None, lights=(), world=0.0, volumes=None, name="test"):
    """A scene with one unmoved instance of every mesh; ``world`` is a constant radiance."""
    return Scene(name=name, meshes=tuple(meshes), instances=tuple(Instance(m.name, i, np.eye(4)) for i, m in enumerate(meshes)),
                 materials=tuple(materials or (material(),)), lights=tuple(lights), world=World.constant(world),
                 volumes=tuple(volumes if volumes is not None else (volume(),)))


def point_light(position=(0.0, 0.0, 0.0), intensity=1.0, name="lamp"):
    """A point without size; ``intensity`` in W·sr⁻¹."""
    return PointLight(name, np.asarray(position, np.float32), np.broadcast_to(np.asarray(intensity, np.float32), (3,)).copy())


def closed_box(albedo=0.5, intensity=1.0, half_size=1.0, light_position=(0.0, 0.0, 0.0), **volume_options):
    """A closed cube seen from inside with a point light in it."""
    return scene([cube("room", half_size, inward=True)], [material("wall", albedo)], [point_light(light_position, intensity)],
                 volumes=[volume(**volume_options)], name="closed_box")


def cube_furnace(albedo=0.5, emission=1.0, half_size=1.0, **volume_options):
    """A closed cube whose walls all emit: radiance is emission/(1−albedo) from everywhere to everywhere (docs/physics.md §2)."""
    return scene([cube("furnace", half_size, inward=True)], [material("glow", albedo, emission)],
                 volumes=[volume(**volume_options)], name="furnace")


def integrating_sphere(albedo=0.5, intensity=np.pi, radius=1.0, light_position=(0.0, 0.0, 0.0), subdivisions=4, **volume_options):
    """A closed sphere with a point light: indirect irradiance Φ/(4πR²)·ρ/(1−ρ) on its wall, wherever the light stands."""
    return scene([sphere("wall", radius, subdivisions, inward=True)], [material("wall", albedo)],
                 [point_light(light_position, intensity)], volumes=[volume(**volume_options)], name="integrating_sphere")


def open_plane(albedo=0.5, world=1.0, half_size=100.0, **volume_options):
    """A large ground plane under a uniform sky."""
    options = {"half_size": 0.5, "center": (0.0, 0.0, 1.0)} | volume_options
    return scene([plane("ground", half_size)], [material("ground", albedo)], world=world, volumes=[volume(**options)],
                 name="open_plane")
