"""What a reflective shadow map holds of lamps with nodes is what light paths of them deposit."""

from dataclasses import replace

import lamp_profiles
import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.scene import AreaLight, LampProfile, PointLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.beam import Beam
from rtgi_addon.transport.paths.from_lights import lamp_paths
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of

POINT = PointLight("lamp", np.float32([0.2, -0.1, 0.3]), np.float32([1.0, 2.0, 0.5]))
AREA = AreaLight("lamp", np.float32([0, 0, 0.8]), np.float32([0.4, 0, 0]), np.float32([0, 0.3, 0]), np.float32([0, 0, -1]),
                 np.float32([1.0, 2.0, 0.5]))
# As a falloff that grows with the square of the distance, from the middle of a unit sphere.
SQUARED = LampProfile(by_distance=lamp_profiles.linear().by_distance ** 2)
LAMPS = {
    "point": replace(POINT, profile=replace(lamp_profiles.by_direction(POINT), by_distance=lamp_profiles.linear().by_distance)),
    "area": replace(AREA, profile=lamp_profiles.by_place()),
    "ellipse": replace(AREA, shape="ELLIPSE", profile=lamp_profiles.by_place()),
    "beam": replace(AREA, spread=0.0, profile=replace(lamp_profiles.by_place(), by_distance=lamp_profiles.linear().by_distance)),
}


def both_ways(light):
    """Reflected flux (3,) [W] of the first bounce inside a cube, in maps and by paths."""
    context = LightContext(build.scene([build.cube("room", 1.0)], [build.material("grey", 0.5)], [light]), 1)
    maps = sum(capture(context, view).total_flux for view in views_of(context, 0, 128, area_points=32))
    beam = Beam(np.array(context.geometry.bounds()), np.zeros(3), 1.0)
    paths = lamp_paths(context, light, 0, np.arange(1 << 14), beam, 1, 1)
    return maps, paths.flux.sum(axis=0) / paths.count


@pytest.mark.parametrize("name", LAMPS)
def test_maps_hold_what_paths_bring(name):
    maps, paths = both_ways(LAMPS[name])
    assert np.all(maps > 0)
    np.testing.assert_allclose(maps, paths, rtol=0.02)


def test_a_constant_falloff_lights_near_and_far_alike():
    """E = I wherever light falls straight: from the middle of a sphere of radius r the flux is r² times the plain lamp's."""
    light = PointLight("lamp", np.zeros(3, np.float32), np.ones(3, np.float32), profile=SQUARED)
    context = LightContext(build.scene([build.sphere("sphere", 3.0, 4)], [build.material("grey", 0.5)], [light]), 1)
    total = sum(capture(context, view).total_flux for view in views_of(context, 0, 64))
    np.testing.assert_allclose(total, 0.5 * 4.0 * np.pi * 9.0, rtol=0.01)
