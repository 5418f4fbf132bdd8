"""What a place lies inside of."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.effects.surroundings import eye_inside
from rtgi_addon.scene import Camera

EYE = np.array([0.5, 0.1, 0.0])
TOLD = "camera eye lies inside crate, which no light gets into: move it into the open"
GREY, GLOW = build.material(), build.material("glow", 0.0, 1.0)


def scene(*meshes, lamp=(0.0, 0.0, 4.0), materials=(GREY, GLOW)):
    """Meshes under a lamp, with a camera at EYE that a bake takes for a reason to call what is about it a room."""
    built = build.scene(list(meshes), list(materials), lights=[build.point_light(lamp)])
    return replace(built, cameras=(Camera("eye", build.transform(EYE), np.eye(4), (10, 10)),))


@pytest.mark.parametrize(("built", "told"), [
    (scene(build.cube("crate")), TOLD),
    (scene(build.cube("crate"), lamp=(0.0, 0.0, 0.5)), ""),
    (scene(build.cube("crate", 0.3)), ""),
    (scene(build.cube("crate", inward=True)), ""),
    (scene(build.cube("crate"), materials=[GLOW]), ""),
    (scene(build.plane("crate", half_size=3.0)), ""),
    (build.scene([], []), ""),
], ids=["in a crate", "in a room", "beside it", "in an inverted box", "in what shines", "over a plane", "nowhere"])
def test_an_eye_in_a_solid_is_told_by_name(built, told):
    assert eye_inside(built, "eye", EYE) == told


def test_flat_instances_hold_nothing():
    flat = replace(scene(build.cube("crate")).instances[0], world_from_local=np.diag([1.0, 1.0, 0.0, 1.0]))
    assert eye_inside(replace(scene(build.cube("crate")), instances=(flat,)), "eye", EYE) == ""
