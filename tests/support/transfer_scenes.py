"""A room with lights in groups, and its transfer, for tests of it."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Instance, PointLight, SunLight


def bake(scene, **settings):
    """The field of ``scene``, quickly."""
    technique = techniques.get("transfer")
    settings = technique.Settings(**{"rays": 512, "sun_side": 3, "sites": 4, **settings})
    return technique.bake(scene, settings, np.random.default_rng(2), Progress(), threads=1)


def room(lamp=1.0, glow=1.0, sun=1.0):
    """A room with a lamp in the group Lamps, a cube that glows in the group Neon, another in none, and a sun."""
    materials = (build.material(albedo=(0.6, 0.5, 0.4)), build.material("glow", 0.2, (3.0 * glow, 1.0 * glow, 0.5 * glow)),
                 build.material("other", 0.2, 0.7))
    meshes = (build.cube("room", 2.0, inward=True), build.cube("neon", 0.3, material_index=1),
              build.cube("rest", 0.2, material_index=2))
    places = (np.eye(4), build.transform((-1, -1, -1)), build.transform((1, 1, -1)))
    instances = tuple(Instance(mesh.name, index, place, light_group="Neon" if mesh.name == "neon" else "")
                      for index, (mesh, place) in enumerate(zip(meshes, places, strict=True)))
    lights = (PointLight("lamp", np.array([0.5, 0.2, 1.0]), np.full(3, 2.0 * lamp, np.float32), light_group="Lamps"),
              SunLight("sun", np.array([0.0, 0.0, -1.0]), np.full(3, sun, np.float32)))
    scene = build.scene(meshes, materials, lights, volumes=(build.volume(resolution=(2, 2, 2), half_size=1.2),))
    return replace(scene, instances=instances)
