"""A small scene and an eye before it: what pictures and effects are tested on."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon.scene import PointLight
from rtgi_addon.transport.views.camera import CameraView

SIZE = 24, 16
LAMP = PointLight("lamp", np.float32([0.3, 1.5, 1.8]), np.float32([3, 2, 1]), casts_shadow=False)


def view(position=(0.0, -3.4, 2.2), orthographic=False, lens=1.4):
    """Looks at a point above the origin."""
    back = np.array(position) - (0, 0, 0.3)
    back /= np.linalg.norm(back)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), position
    near, far, aspect = 0.1, 50.0, SIZE[1] / SIZE[0]
    clip = np.array([[lens * aspect, 0, 0, 0], [0, lens, 0, 0], [0, 0, -(far + near) / (far - near),
                                                                 -2 * far * near / (far - near)], [0, 0, -1, 0]])
    if orthographic:
        clip = np.array([[0.5 * aspect, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, -2 / (far - near), -(far + near) / (far - near)],
                         [0, 0, 0, 1]])
    return CameraView(pose, clip)


def stage(lamps=(LAMP,), world=0.3, material=None):
    """A floor and a glowing ball."""
    ball = build.sphere("ball", 0.4, 2, material_index=1)
    scene = build.scene([build.plane("floor", 2.0), ball], [material or build.material("floor", (0.8, 0.6, 0.4)),
                                                            build.material("ball", 0.5, 0.25)], list(lamps), world)
    placed = replace(scene.instances[1], world_from_local=build.transform((0.1, 0.1, 0.6)))
    return replace(scene, instances=(scene.instances[0], placed))
