"""The light that a volume captures, by Blender's own Capture and Intensity."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon.scene import World
from rtgi_addon.scene.capture import as_it_is, captured_light, direct_light


def lit():
    """A scene with a lamp, a glowing wall and a sky."""
    glow = build.material("glow", 0.5, 3.0)
    scene = build.scene([build.cube()], [glow, replace(glow, name="both", back=build.material("back", 0.5, 5.0))],
                        [build.point_light(intensity=(1, 2, 3))], world=0.25)
    return scene, scene.volumes[0]


def strengths(scene):
    """What of lamps, of emission on both sides of each material, and of the world there is."""
    return ([light.intensity.tolist() for light in scene.lights],
            [[float(face.emission.constant[0]) for face in (material, material.back) if face] for material in scene.materials],
            float(scene.world.equirect.max()))


def test_blenders_defaults_leave_everything_as_it_is():
    """A new volume has Capture World off: that takes no light away."""
    scene, volume = lit()
    assert captured_light(scene, replace(volume, capture_world=False)) is scene and direct_light(scene, volume) is scene


def test_what_is_not_captured_is_dark():
    scene, volume = lit()
    lamps = [[1, 2, 3]]
    assert strengths(captured_light(scene, replace(volume, capture_emission=False))) == (lamps, [[0], [0, 0]], 0.25)
    assert strengths(captured_light(scene, replace(volume, capture_bounces=False))) == ([], [[3], [3, 5]], 0.25)
    # The direct light of a lamp that is set to it is no bounce.
    assert direct_light(scene, replace(volume, capture_bounces=False)) is scene


def test_intensity_multiplies_what_is_captured_and_the_world_with_it_if_that_is():
    scene, volume = lit()
    twice = replace(volume, intensity=2.0, capture_world=False)
    assert strengths(captured_light(scene, twice)) == ([[2, 4, 6]], [[6], [6, 10]], 0.25)
    assert strengths(captured_light(scene, replace(twice, capture_world=True))) == ([[2, 4, 6]], [[6], [6, 10]], 0.5)
    assert [light.intensity.tolist() for light in direct_light(scene, twice).lights] == [[2, 4, 6]]
    assert captured_light(replace(scene, world=World.constant(0.0)), twice).world.is_black


def test_techniques_are_measured_by_light_as_it_is():
    scene, volume = lit()
    other = replace(scene, volumes=(replace(volume, intensity=3.0, capture_emission=False, capture_bounces=False),))
    assert as_it_is(scene) is scene and all(one.captures_all for one in as_it_is(other).volumes)
    np.testing.assert_array_equal(as_it_is(other).volumes[0].world_from_local, volume.world_from_local)
