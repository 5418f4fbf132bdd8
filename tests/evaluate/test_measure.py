"""What a yard measures, held to a scene whose answer is known everywhere."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError
from rtgi_addon.evaluate.measure import PLACES, Yard, scaled_resolution
from rtgi_addon.jobs.settings import build_settings
from rtgi_addon.scene import Instance


@pytest.fixture(scope="module")
def yard():
    """A furnace: irradiance π·Le/(1−ρ) = 2π under every normal."""
    return Yard(build.cube_furnace(albedo=0.5, resolution=(3, 3, 3)), points=24, normals_per_point=3, probes=8, noise=0.02,
                threads=1)


def test_probes_in_a_furnace_are_right_everywhere(yard):
    probes = techniques.get("probes")
    run = yard.measure(probes, build_settings(probes, {"error": 0.02}), seed=0)
    assert set(run.errors) == set(PLACES) - {"known", "atlas"}
    for place, errors in run.errors.items():
        assert errors.error < 0.03 and abs(errors.bias) < 0.02, place
        assert errors.energy == pytest.approx(1 + errors.bias) and errors.leak is None, place
    assert run.errors["shipped"] == run.errors["surface"]
    assert run.costs.rays >= run.baked.stats["rays"] and run.costs.seconds > 0 and run.field_bytes > 27 * 9 * 3 * 4


def test_other_lattices(yard):
    probes = techniques.get("probes")
    run = yard.measure(probes, build_settings(probes, {"error": 0.05}), seed=0, lattice=2.0)
    assert [grid.volume.resolution for grid in run.baked.grids()] == [(6, 6, 6)] and run.lattice == 2.0
    assert set(run.errors) == {"surface", "own_normals", "shipped"} and run.errors["surface"].error < 0.05
    assert scaled_resolution((5, 2, 1), 0.5) == (2, 1, 1) and yard.scene.volumes[0].resolution == (3, 3, 3)


def test_a_technique_that_knows_less_is_held_to_both():
    yard = Yard(build.closed_box(albedo=0.7, light_position=(0.3, 0.2, 0.4)), points=32, normals_per_point=1, probes=4, noise=0.03,
                threads=1)
    rsm = techniques.get("rsm")
    run = yard.measure(rsm, build_settings(rsm, {"samples": 1600, "resolution": 128, "visibility": True}), seed=0)
    # Albedo 0.7 puts seven tenths of the bounced light into further bounces, which RSM lacks.
    assert run.errors["known"].error < 0.15 < run.errors["surface"].error
    assert run.errors["surface"].bias < -0.5


def test_the_references_noise_is_not_taken_for_error(yard):
    truth = yard.truth
    exact = np.full_like(truth.mean, 2 * np.pi)
    assert truth.noise > 0 and yard.floor < truth.noise
    errors = yard._errors("surface", exact, techniques.get("probes"))
    assert errors.error < 3 * yard.floor


def test_leaks_are_told_from_light_that_is_there():
    from room_scenes import two_rooms
    yard = Yard(two_rooms(), points=64, normals_per_point=1, probes=4, noise=0.05, threads=1)
    assert 0 < yard.dark.sum() < len(yard.dark)
    estimate = np.where(yard.dark[:, None], 0.5, 2.0) * np.ones((1, 3))
    errors = yard._errors("surface", estimate, techniques.get("probes"))
    assert errors.leak == pytest.approx(0.25) and errors.true_leak == 0.0


def test_probes_that_a_bake_moves_are_not_compared_at_their_lattice_points():
    """A lamp lights one side of a sheet on the middle plane of the lattice: a probe there stands on one side or the other."""
    scene = build.closed_box(albedo=0.5, light_position=(0.3, 0.2, 0.6))
    plate = build.plane("plate", 0.5)
    scene = replace(scene, meshes=(*scene.meshes, plate), volumes=(build.volume(resolution=(3, 3, 3), half_size=0.9),),
                    instances=(*scene.instances, Instance("plate", len(scene.meshes), np.eye(4))))
    yard = Yard(scene, points=8, normals_per_point=1, probes=27, noise=0.05, threads=1)
    middle = 13
    assert middle not in yard.probe_rows and len(yard.probe_rows) >= 18
    technique = techniques.get("probes")
    run = yard.measure(technique, build_settings(technique, {"error": 0.03}), 1)
    assert run.errors["probes"].error < 0.06


def test_a_volumes_own_settings_do_not_stand_in_the_way():
    from dataclasses import replace
    scene = build.closed_box()
    scene = replace(scene, volumes=(replace(scene.volumes[0], settings={"order": 0}),))
    assert Yard(scene, points=2, probes=1, threads=1).scene.volumes[0].settings == {}


def test_nothing_to_measure_is_said():
    with pytest.raises(BakeError, match="no probe volume"):
        Yard(build.scene([build.cube()], volumes=[]))
    with pytest.raises(BakeError, match="no probe lies in the open"):
        Yard(build.scene([build.cube()], volumes=[build.volume(half_size=0.1)]), threads=1)
    with pytest.raises(BakeError, match="no surface can be seen"):
        Yard(build.scene([build.cube()], volumes=[build.volume(half_size=1.0, center=(1e7, 0, 0))]), threads=1)


@pytest.mark.parametrize("name", techniques.names())
def test_sweeps_are_valid_different_and_hold_the_defaults(name):
    technique = techniques.get(name)
    sweep = technique.sweep()
    assert technique.Settings() in sweep and len(set(sweep)) == len(sweep) >= 4
    for settings in sweep:
        techniques.validate_settings(settings)
