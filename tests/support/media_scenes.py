"""Media in empty space, and one pixel that looks at them."""

import numpy as np
import scene_builders as build

from rtgi_addon.effects import get
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.numerics import sh
from rtgi_addon.scene import ClosedMesh, Instance, Scene, World
from rtgi_addon.techniques.base import Field
from rtgi_addon.transport.views.camera import CameraView

MEDIA = get("media")
CUBE = build.cube()
GREY = np.ones(3)


class Uniform(Field):
    """The same radiance everywhere, from everywhere."""

    technique = "uniform"

    def __init__(self, radiance=1.0, lit=(1.0, 1.0)):
        self._radiance, self._lit = radiance, lit
        self.params, self.stats = {}, {}

    def irradiance(self, points, normals):
        """See Field."""
        return np.full((len(points), 3), np.pi * self._radiance, np.float32)

    def radiance_sh(self, points, order=2):
        """See Field; brighter from one side than from the other if ``lit`` says so."""
        low, high = self._lit
        directions, weights = sh.quadrature(4)
        radiance = np.where(directions[:, :1] > 0, high, low) * self._radiance * np.ones((1, 3))
        return np.tile(sh.project(directions, radiance, weights, order)[None], (len(points), 1, 1)).astype(np.float32)

    def arrays(self):
        """See Field."""
        return {}


def box(low, high):
    """A closed box."""
    low, high = np.array(low, float), np.array(high, float)
    return ClosedMesh(CUBE.vertices_local, CUBE.triangles, build.transform((low + high) / 2, (high - low) / 2))


def scene_of(media, lights=(), world=0.0, wall=None):
    """Media in empty space; a wall across x, if there is one."""
    meshes = (build.plane("wall", 1.0),)
    turn = np.array([[0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]], float) * [400, 400, 400, 1]
    place = turn if wall is not None else build.transform((0, 0, -1e5))
    place[0, 3] = 0 if wall is None else wall
    return Scene("media", meshes, (Instance("wall", 0, place),), (build.material("wall", 0.5),), tuple(lights),
                 World.constant(world), (build.volume(),), media=tuple(media))


def eye(position=(0, 0, 0), towards=(1, 0, 0), width=1e-6):
    """A very narrow view."""
    back = -np.array(towards, float) / np.linalg.norm(towards)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), position
    near, far = 0.01, 1e4
    clip = np.array([[1 / width, 0, 0, 0], [0, 1 / width, 0, 0], [0, 0, -(far + near) / (far - near),
                                                                  -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return CameraView(pose, clip)


def ray(scene, field=None, samples=1, seen_by=None, **settings):
    """What one narrow pixel sees (3,): light, transmittance, direct, indirect."""
    found, settings = [], MEDIA.Settings(**{"tile": 1, **settings})
    for index in range(samples):
        frame = draw_frame(scene, field, seen_by or eye(), (1, 1), index=index)
        light = MEDIA.apply(frame, field, settings)
        found.append([light[0, 0, :3], *(frame.passes[name][0, 0, :3] for name in ("transmittance", "volume_direct",
                                                                                  "volume_indirect"))])
    return np.mean(found, axis=0)
