"""Transfer in the light of a scene as it is now, and sliders that change it."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from transfer_scenes import bake, room

from rtgi_addon.errors import BakeError
from rtgi_addon.scene import DensityGrid, Medium, PointLight, World
from rtgi_addon.techniques.transfer.controls import LightControls, controlled, sun_towards
from rtgi_addon.techniques.transfer.follow import lighting_in
from rtgi_addon.techniques.transfer.media import media_left_out


@pytest.fixture(scope="module")
def field():
    return bake(room())


def test_the_same_scene_is_the_bake(field):
    lighting = lighting_in(field.transfer, room())
    assert lighting.world is None and lighting.suns is None and not lighting.groups and not lighting.lamps
    assert np.allclose(field.relight(room()).grids()[0].sh, field.grids()[0].sh, atol=1e-6)


def test_strengths_are_followed_by_groups(field):
    lighting = lighting_in(field.transfer, room(lamp=0.5, glow=3.0))
    assert lighting.groups.keys() == {"Lamps", "Neon"} and lighting.suns is None
    assert np.allclose(lighting.groups["Lamps"], 0.5) and np.allclose(lighting.groups["Neon"], 3.0)


def test_suns_and_sky_are_followed_whatever_they_do(field):
    scene = room(sun=5.0)
    sun = replace(scene.lights[1], direction_world=np.array([0.6, 0.0, -0.8]))
    lighting = lighting_in(field.transfer, replace(scene, lights=(scene.lights[0], sun), world=World.constant(0.3)))
    assert np.allclose(lighting.suns[0].towards, [-0.6, 0.0, 0.8]) and np.allclose(lighting.suns[0].irradiance, 5.0)
    assert np.allclose(lighting.world.equirect, 0.3)
    assert lighting_in(field.transfer, replace(scene, lights=scene.lights[:1])).suns == ()


def test_new_point_lamps_go_by_the_sites(field):
    scene = room()
    lamp = PointLight("new", np.array([0.0, 1.0, 0.0]), np.full(3, 2.0, np.float32))
    lighting = lighting_in(field.transfer, replace(scene, lights=(*scene.lights, lamp)))
    assert len(lighting.lamps) == 1 and np.allclose(lighting.lamps[0].watts, 8.0 * np.pi)


def test_what_cannot_be_followed_is_refused_by_name(field):
    scene = room()
    moved = replace(scene.lights[0], position_world=np.array([0.0, 0.0, 0.0]))
    with pytest.raises(BakeError, match="lamp lamp changed more than its strength since the bake"):
        lighting_in(field.transfer, replace(scene, lights=(moved, scene.lights[1])))


def test_one_of_a_group_alone_is_refused(field):
    scene = room()
    pair = (*scene.lights, replace(scene.lights[0], name="second"))
    transfer = bake(replace(scene, lights=pair), rays=64, sites=1).transfer
    dimmed = replace(pair[2], intensity=pair[2].intensity * np.float32(0.5))
    with pytest.raises(BakeError, match="changed otherwise than the rest of the light group Lamps: give it a light group"):
        lighting_in(transfer, replace(scene, lights=(*pair[:2], dimmed)))


def test_groups_by_sliders_are_fresh_bakes(field):
    controls = LightControls(groups=(("Neon", (2.0, 2.0, 2.0)), ("Lamps", (0.25, 0.25, 0.25))))
    scene = controlled(room(), controls)
    fresh, mine = bake(scene).grids()[0].sh, field.relight(scene).grids()[0].sh
    assert np.abs(fresh - mine).max() < 1e-5 * np.abs(fresh).max()
    # The other emissive cube keeps its material, and the direct light of the lamp is dimmed as well.
    assert np.allclose(scene.lights[0].intensity, 0.5)
    assert scene.instances[2].material_override is None and scene.instances[1].material_override


def test_sliders_that_change_nothing_leave_the_scene():
    scene = room()
    assert controlled(scene, LightControls(groups=(("Neon", (1.0, 1.0, 1.0)),))) is scene


def test_the_sun_goes_its_way():
    # At the equinox on the equator: east at six, overhead at noon, west at eighteen.
    for hour, towards in ((6.0, (1, 0, 0)), (12.0, (0, 0, 1)), (18.0, (-1, 0, 0))):
        assert np.allclose(sun_towards(hour, 0.0, 80), towards, atol=1e-9)
    noon = sun_towards(12.0, 50.0, 172)
    assert np.degrees(np.arcsin(noon[2])) == pytest.approx(90.0 - 50.0 + 23.44, abs=0.1) and noon[1] < 0 and abs(noon[0]) < 1e-9
    scene = controlled(room(), LightControls(hour=0.0))
    assert not scene.lights[1].irradiance.any() and scene.lights[0].intensity.any()
    scene = controlled(room(), LightControls(hour=12.0, latitude=0.0, day=80))
    assert np.allclose(scene.lights[1].direction_world, [0, 0, -1]) and np.allclose(scene.lights[1].irradiance, 1.0)


def test_a_turned_sky_is_another_world(field):
    image = np.random.default_rng(0).uniform(0, 1, (8, 16, 3)).astype(np.float32)
    scene = replace(build.open_plane(0.5), world=World(image))
    quarter = controlled(scene, LightControls(sky_turn=90.0)).world
    from rtgi_addon.transport.lights.environment import Environment
    north = np.array([[0.0, 1.0, 0.2]])
    east = np.array([[1.0, 0.0, 0.2]])
    assert np.allclose(Environment(quarter).radiance(north), Environment(scene.world).radiance(east), atol=1e-5)


def test_media_are_named_with_what_they_take():
    """A haze of 0.1 a metre through a box of 2 m, and a fire."""
    scene = build.scene([build.cube("room", 2.0, inward=True)], volumes=(build.volume(resolution=(2, 2, 2), half_size=1.0),))
    box = DensityGrid(np.diag([0.5, 0.5, 0.5, 1.0]), np.full((1, 1, 1), 2.0, np.float32))
    scene = replace(scene, media=(
        Medium("Haze", np.full(3, 0.06), np.full(3, 0.04)), Medium("Fire", np.full(3, 0.5), emission=np.ones(3), grid=box),
        Medium("Ghost", np.full(3, 0.5), bake="DYNAMIC")))
    said = [omission.text for omission in media_left_out(scene)]
    haze, fire = (100.0 * (1.0 - np.exp(-depth * np.sqrt(3.0))) for depth in (0.1, 0.5))
    assert said == [
        f"transfer leaves medium 'Haze' out: it takes {haze:.0f} % of the light that crosses all of it",
        f"transfer leaves medium 'Fire' out: it takes {fire:.0f} % of the light that crosses all of it, and gives light of its own"]
