"""Frames of shapes with closed forms, made pixel by pixel without a ray: what styles are measured on."""

import numpy as np

from rtgi_addon.effects import Frame
from rtgi_addon.scene import Instance, Material, Mesh, Scene
from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.gbuffer import GBuffer


def orthographic(size, height=2.0):
    """Looks down from z = 5 on ``height`` metres of the plane z = 0, with pixels as wide as they are high."""
    near, far = 0.1, 10.0
    pose = np.eye(4)
    pose[2, 3] = 5.0
    clip = np.array([[2 / (height * size[0] / size[1]), 0, 0, 0], [0, 2 / height, 0, 0],
                     [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1]])
    return CameraView(pose, clip)


def perspective(size, pose, lens=1.0, near=0.01, far=1e4):
    """Sees ``1 / lens`` of its distance from the middle to the upper edge."""
    clip = np.array([[lens * size[1] / size[0], 0, 0, 0], [0, lens, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView(pose, clip)


def frame_of(view, position, normal, seen, *, instance=0, material=0, albedo=0.5, irradiance=1.0, direct=0.0, materials=1,
             instances=None, geometry=None):
    """A Frame of arrays (h, w, 3) ``position`` and ``normal``, (h, w) ``seen`` and what broadcasts to (h, w): the indices, grey
    ``albedo``, ``irradiance`` and ``direct`` of luminance."""
    height, width = seen.shape
    targets = np.zeros((6, height, width, 4), np.float32)
    mask = seen[..., None]
    targets[0][..., :3], targets[1][..., :3] = position * mask, normal * mask
    index = np.broadcast_to(material, seen.shape)
    targets[0][..., 3] = np.where(seen, 65536.0 * (index // 256), 0)
    targets[1][..., 3] = np.where(seen, 65536.0 * (index % 256) + 1, 0)
    targets[2][..., :3] = np.broadcast_to(np.float32(albedo), seen.shape)[..., None] * mask
    targets[2][..., 3] = np.where(seen, instance, 0)
    targets[5][..., :3] = (normal if geometry is None else geometry) * mask
    arriving, lamps = np.zeros((2, height, width, 4), np.float32)
    arriving[..., :3] = np.broadcast_to(np.float32(irradiance), seen.shape)[..., None] * mask
    lamps[..., 3] = np.where(seen, direct, 0)
    lamps[..., :3] = targets[2][..., :3] * lamps[..., 3:] / np.float32(np.pi)
    count = int(np.max(np.where(seen, instance, 0))) + 1 if instances is None else len(instances)
    nothing = Mesh("nothing", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
    scene = Scene("flat", (nothing,), materials=tuple(Material(f"material {index}") for index in range(materials)),
                  instances=instances or tuple(Instance(f"object {index}", 0, np.eye(4)) for index in range(count)))
    return Frame(scene, view, GBuffer(*targets), lamps, arriving, lamps).lit()


def pixel_centres(view, size):
    """Origins and unit directions (h, w, 3) of the rays through pixels' centres."""
    width, height = size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    origins, directions, _ = view.through(x.ravel(), y.ravel(), size)
    return origins.reshape(height, width, 3), directions.reshape(height, width, 3)


def sphere(size, radius=0.8, centre=(0.0, 0.0), direct=None, **given):
    """A ball seen from above; ``direct`` maps its normals (h, w, 3) to irradiance."""
    view = orthographic(size)
    origins, _ = pixel_centres(view, size)
    away = (origins[..., :2] - centre) / radius
    flat = np.sum(away**2, axis=-1)
    seen = flat < 1
    up = np.sqrt(np.where(seen, 1 - flat, 0))
    normal = np.dstack([away, up])
    position = normal * radius + np.array([*centre, 0.0])
    if direct is not None:
        given["direct"] = direct(normal)
    return frame_of(view, position, normal, seen, **given)


def floor(size, eye=1.0, down=0.2, lens=1.0, spin=0.0, scale=1.0, **given):
    """A plane z = 0 that runs to the horizon, seen from ``eye`` metres above it, ``down`` radians below the horizontal, the eye
    turned by ``spin`` about its own axis."""
    forward = np.array([0.0, np.cos(down), -np.sin(down)])
    right, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, np.sin(down), np.cos(down)])
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1] = np.cos(spin) * right + np.sin(spin) * up, np.cos(spin) * up - np.sin(spin) * right
    pose[:3, 2], pose[2, 3] = -forward, eye * scale
    view = perspective(size, pose, lens, near=0.01 * scale, far=1e4 * scale)
    origins, directions = pixel_centres(view, size)
    seen = directions[..., 2] < -1e-4
    way = np.where(seen, -origins[..., 2] / np.where(seen, directions[..., 2], 1), 0)
    normal = np.broadcast_to([0.0, 0.0, 1.0], (*seen.shape, 3))
    return frame_of(view, origins + directions * way[..., None], normal, seen, **given)
