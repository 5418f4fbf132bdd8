"""The probe bake against closed forms and the path reference, and its promises: errors, bounces, threads, resuming, placement.

Coefficients are compared relative to their RMS over all probes. Seeds are fixed.
"""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import QUICK, Memory, bake, bytes_of, coefficients, positions, rms

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.numerics import sh
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight
from rtgi_addon.techniques.probes import bake as bake_module
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths import reference as path

Y00 = np.sqrt(0.25 / np.pi)
ACCURACY = {
    "closed box": build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)),
    "emissive panel": rooms.panel_room(0.6),
    "textures": rooms.textured_room(),
    "cut-outs": rooms.screen_room(),
    "many lamps": rooms.many_lamps(),
    "sun patch": rooms.sun_patch_room(),
    "sky with a sun": rooms.courtyard(),
    "open plane": build.open_plane(),
}


@pytest.mark.parametrize("name", ACCURACY)
def test_error_is_what_was_asked_for_and_what_is_reported(name):
    """At 3 %: the scatter between eight seeds is below it and within a factor of two of the reported standard error, and their
    mean is the path reference's, within 0.7 % and the noise of both."""
    scene, asked = ACCURACY[name], 0.03
    fields = [bake(scene, seed, error=asked) for seed in range(8)]
    runs = np.stack([coefficients(field) for field in fields])
    scale, scatter = rms(runs.mean(axis=0)), np.sqrt(runs.var(axis=0, ddof=1).mean())
    assert scatter < asked * scale
    reported = rms([grid.standard_error for field in fields for grid in field.grids()])
    assert 0.5 < reported / scatter < 2, (reported / scale, scatter / scale)
    result = path.probe_sh(LightContext(scene), positions(scene), 2, 8192, seed=3)
    noise = np.sqrt(np.mean(np.square(result.standard_error, dtype=float)) + scatter**2 / len(runs))
    assert rms(runs.mean(axis=0) - result.mean) < 0.007 * scale + 1.4 * noise, (rms(runs.mean(axis=0) - result.mean), noise)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["closed box", "emissive panel", "sky with a sun"])
def test_default_settings_reach_one_per_cent(name):
    scene = ACCURACY[name]
    result = path.probe_sh(LightContext(scene), positions(scene), 2, 1 << 17, seed=4)
    reference, noise = result.mean.astype(float), rms(result.standard_error)
    squares = [np.mean((coefficients(bake(scene, seed)) - reference) ** 2) - noise**2 for seed in range(4)]
    assert np.sqrt(np.mean(squares)) < 0.01 * rms(reference)


def test_a_bright_texel_of_a_texture_lights_like_a_lamp_of_its_size():
    """An LED on a dark panel: one texel in 65,536 has all the light. Rays never find it, samples by power always do, and the error
    that is reported is not smaller than what it is."""
    spotted, plain = (bake(scene, error=0.015) for scene in rooms.spotted_room(resolution=(2, 2, 2)))
    off = coefficients(spotted) - coefficients(plain)
    assert rms(off) < 0.025 * rms(coefficients(plain))
    reported = np.concatenate([grid.standard_error.ravel() for grid in spotted.grids()])
    assert rms(off) < 3.0 * np.sqrt(2.0) * rms(reported)


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.9])
def test_furnace(albedo):
    """L = Le/(1 − ρ) from everywhere: only the constant band, up to the quadrature of the rays."""
    field = bake(build.cube_furnace(albedo, emission=2.0), rays=1024, cache_rays=32, texel_size=0.5)
    expected = np.zeros((8, 9, 3))
    expected[:, 0] = 2.0 / (1 - albedo) / Y00
    np.testing.assert_allclose(coefficients(field)[:, 0], expected[:, 0], rtol=5e-4)
    np.testing.assert_allclose(coefficients(field), expected, atol=3e-3 * expected[0, 0, 0])


@pytest.mark.parametrize("bounces", [0, 1, 2, 5])
def test_bounces_count_reflections(bounces):
    """In the furnace L = Le·Σ ρ^k up to k = bounces; without emission zero bounces leave nothing of a lamp."""
    field = bake(build.cube_furnace(0.5, emission=1.0), bounces=bounces, **QUICK)
    np.testing.assert_allclose(coefficients(field)[:, 0] * Y00, 2 - 0.5**bounces, rtol=5e-4)
    lamp = coefficients(bake(build.closed_box(0.5), bounces=bounces, **QUICK))
    assert lamp.any() == (bounces > 0)


def test_no_bounces_leave_the_world_and_emission():
    """Over a white plane, the upper half of a uniform sky and nothing below: L00 = √π."""
    half = coefficients(bake(build.open_plane(0.9, half_size=3000.0), bounces=0, rays=4096, cache_rays=16, texel_size=1.0))
    np.testing.assert_allclose(half[:, 0], 0.5 / Y00, rtol=0.01)
    unlit = bake(rooms.panel_room(), bounces=0, rays=1024, cache_rays=16, texel_size=0.25)
    result = path.probe_sh(LightContext(rooms.panel_room()), positions(rooms.panel_room()), 2, 16384, bounces=0)
    assert rms(coefficients(unlit) - result.mean) < 0.015 * rms(result.mean) + 1.3 * rms(result.standard_error)


def test_bounces_of_lamps_agree_with_the_path_reference():
    scene = build.closed_box(0.8, light_position=(0.3, -0.2, 0.5))
    for bounces in (1, 2):
        result = path.probe_sh(LightContext(scene), positions(scene), 1, 8192, bounces=bounces)
        measured = coefficients(bake(scene, bounces=bounces, order=1, error=0.02))
        assert rms(measured - result.mean) < 0.02 * rms(result.mean) + 1.3 * rms(result.standard_error)


def test_direct_light_of_a_point_lamp_in_free_space():
    """E = I/r² from one direction, so L_lm = E·Y_lm; over a black floor that is all, and behind it there is none."""
    scene = build.scene([build.plane("floor", 5.0, z=-1.0)], [build.material("black", 0.0)],
                        [build.point_light((0.3, 0.2, 1.5), (1.0, 2.0, 3.0))],
                        volumes=[build.volume(resolution=(2, 2, 2), half_size=(0.5, 0.5, 2.0), center=(0, 0, -1.0))])
    field = bake(scene, order=3, direct=True, **QUICK)
    assert field.includes_direct
    towards = np.array([0.3, 0.2, 1.5]) - positions(scene)
    distance = np.linalg.norm(towards, axis=1)
    irradiance = np.array([1.0, 2.0, 3.0]) / distance[:, None] ** 2
    expected = sh.evaluate((towards / distance[:, None]).astype(np.float32), 3)[:, :, None] * irradiance[:, None]
    below = positions(scene)[:, 2] < -1
    assert below.any() and not below.all()
    expected[below] = 0
    np.testing.assert_allclose(coefficients(field), expected, atol=1e-5)
    assert not coefficients(bake(scene, **QUICK)).any()


def test_direct_light_comes_on_top():
    """Of a lamp with an extent and a sun: what is added is their light, tested by its irradiance on a facing plane."""
    sun = SunLight("sun", np.float32([0, 0, -1]), np.float32([3, 2, 1]), angle=0.1)
    scene = build.scene([build.plane("floor", 5.0, z=-1.0)], [build.material("grey", 0.5)], [sun])
    without, with_lamps = (coefficients(bake(scene, direct=direct, **QUICK)) for direct in (False, True))
    added = (with_lamps - without)[0]
    irradiance = sh.irradiance(added.astype(np.float32), np.float32([[0, 0, 1]]))
    # A delta's irradiance through L2 peaks at 1.0625 of the true one.
    np.testing.assert_allclose(irradiance.reshape(-1, 3)[0], np.array([3, 2, 1]) * 1.0625, rtol=0.01)
    np.testing.assert_allclose(added[0], np.array([3, 2, 1]) * Y00, rtol=0.01)


def test_lower_orders_are_the_first_coefficients_of_higher_ones():
    scene = rooms.sun_patch_room()
    highest = coefficients(bake(scene, order=4, **QUICK))
    for order in range(4):
        lower = coefficients(bake(scene, order=order, **QUICK))
        assert lower.shape[1] == (order + 1) ** 2
        np.testing.assert_allclose(lower, highest[:, : (order + 1) ** 2], atol=1e-5 * rms(highest))


@pytest.mark.parametrize("rays", [16, 100, 1000])
def test_a_fixed_number_of_rays_is_kept(rays):
    """Rounded up to what two halves with their light samples take."""
    field = bake(build.closed_box(), **{**QUICK, "rays": rays})
    assert field.stats["probe_rays"] == 8 * (-(-rays // 16) * 16)


def test_no_probe_traces_more_than_the_most_rays():
    field = bake(rooms.panel_room(), error=1e-4, max_rays=512, cache_rays=16, texel_size=0.25)
    assert field.stats["probe_rays"] <= 8 * 512


def test_fewer_rays_are_traced_for_a_larger_error():
    scene = rooms.panel_room()
    rays = [bake(scene, error=error, cache_rays=32, texel_size=0.1).stats["probe_rays"] for error in (0.05, 0.01)]
    assert rays[1] > 2 * rays[0]


def test_a_dark_room_is_exactly_dark_and_its_neighbour_is_lit():
    scene = rooms.two_rooms()
    result = path.probe_sh(LightContext(scene), positions(scene), 2, 8192)
    measured = coefficients(bake(scene, error=0.02))
    dark = positions(scene)[:, 0] > 0
    assert dark.sum() == 2 and not measured[dark].any()
    assert rms((measured - result.mean)[~dark]) < 0.02 * rms(measured[~dark]) + 1.3 * rms(result.standard_error[~dark])


@pytest.mark.parametrize("scene", [rooms.sun_patch_room(), rooms.panel_room(), rooms.many_lamps(12), rooms.courtyard()],
                         ids=lambda scene: scene.name)
def test_threads_do_not_change_a_byte(scene):
    assert len({bytes_of(bake(scene, threads=threads, error=0.1, texel_size=0.3)) for threads in (1, 2, 5)}) == 1
    assert bytes_of(bake(scene, seed=1, **QUICK)) != bytes_of(bake(scene, seed=2, **QUICK))


@pytest.mark.parametrize("scene", [rooms.sun_patch_room(), rooms.panel_room(), rooms.courtyard()], ids=lambda scene: scene.name)
def test_a_resumed_bake_ends_with_the_same_bytes(scene, monkeypatch):
    """Broken off after any of the first batches, half way and at the last one; two volumes with settings of their own."""
    monkeypatch.setattr(bake_module, "BATCH_RAYS", 1 << 11)
    monkeypatch.setattr(bake_module, "ITEM_RAYS", 1 << 10)
    small = replace(build.volume("small", (2, 1, 1), 0.3, center=np.array(scene.volumes[0].world_from_local)[:3, 3]),
                    settings={"order": 1})
    scene = replace(scene, volumes=(scene.volumes[0], small))
    settings = {"error": 0.1, "texel_size": 0.3}
    whole = Memory()
    expected = bytes_of(bake(scene, checkpoint=whole, **settings))
    assert whole.saves >= 4 and expected == bytes_of(bake(scene, **settings))
    for stop in sorted({1, 2, whole.saves // 2, whole.saves}):
        broken = Memory(stop=stop)
        with pytest.raises(KeyboardInterrupt):
            bake(scene, checkpoint=broken, **settings)
        assert bytes_of(bake(scene, checkpoint=Memory(broken.stored), threads=1, **settings)) == expected


@pytest.mark.parametrize("after", [1, 5, 20])
def test_cancelling_stops_at_the_next_step(after):
    calls = []

    def report(fraction, label, seconds_left):
        calls.append(fraction)
        if len(calls) == after:
            progress.cancel()

    progress = Progress(report, interval=0.0)
    with pytest.raises(Cancelled):
        bake(rooms.many_lamps(), progress=progress, error=0.01)
    assert len(calls) == after


def test_progress_never_goes_back():
    fractions = []
    bake(rooms.sun_patch_room(), progress=Progress(lambda fraction, *_: fractions.append(fraction), interval=0.0), error=0.05)
    assert len(fractions) > 5 and 0 <= min(fractions) and max(fractions) <= 1
    assert np.all(np.diff(fractions) >= -1e-9)


def crate_scene(**volume_options):
    """A crate of half a metre's half side on a floor under a sky, and a line of probes that runs through its wall."""
    crate, floor = build.cube("crate", 0.5), build.plane("floor", 5.0, z=-2.0)
    return build.scene([crate, floor], world=1.0, volumes=[build.volume(**volume_options)])


def test_a_probe_just_inside_a_crate_is_moved_out():
    """5 cm inside: it moves out by that and a twentieth of a cell; validity still tells of the lattice point."""
    scene = crate_scene(resolution=(2, 1, 1), half_size=(0.9, 0.1, 0.1), center=(0.9, 0.0, 0.0))
    (grid,) = bake(scene, rays=256, cache_rays=16, texel_size=0.25).grids()
    np.testing.assert_allclose(positions(scene)[:, 0], [0.45, 1.35])
    assert grid.validity[0, 0].tolist() == [0, 1]
    offset = grid.offset_world[0, 0]
    assert not offset[1].any() and 0.05 < offset[0, 0] < 0.05 * 3 and np.linalg.norm(offset[0]) < 0.45 * 0.2
    assert grid.usable.tolist() == [[[False, True]]]
    # Measured against the crate's wall: half the sphere is the crate, half sky and floor.
    moved = positions(scene)[:1] + offset[:1]
    reference = path.probe_sh(LightContext(scene), moved, 2, 8192).mean
    np.testing.assert_allclose(grid.sh[0, 0, 0], reference[0], atol=0.03 * rms(reference))


def test_a_probe_deep_inside_is_invalid_and_holds_its_neighbours_light():
    scene = crate_scene(resolution=(3, 1, 1), half_size=(1.2, 0.1, 0.1))
    (grid,) = bake(scene, **QUICK).grids()
    assert grid.validity[0, 0].tolist() == [1, 0, 1] and not grid.offset_world.any()
    assert np.isnan(grid.standard_error[0, 0, 1]) and np.isfinite(grid.standard_error[0, 0, ::2]).all()
    np.testing.assert_allclose(grid.sh[0, 0, 1], grid.sh[0, 0, ::2].mean(axis=0), rtol=1e-5, atol=1e-6)


def test_without_virtual_offset_probes_stay():
    scene = crate_scene(resolution=(2, 1, 1), half_size=(0.9, 0.1, 0.1), center=(0.9, 0.0, 0.0))
    (grid,) = bake(scene, virtual_offset=False, **QUICK).grids()
    assert not grid.offset_world.any() and grid.validity[0, 0].tolist() == [0, 1]


def test_a_volume_inside_geometry_is_refused_by_name():
    scene = crate_scene(name="buried", resolution=(2, 2, 2), half_size=0.1)
    with pytest.raises(BakeError, match="'buried'"):
        bake(scene, **QUICK)


def test_probes_whose_first_rays_meet_nothing():
    """A speck of geometry far away: sky alone, in bake and relighting, until a ray does hit."""
    speck = rooms.moved(build.cube("speck", 0.01), (0, 0, -8))
    scene = build.scene([speck], world=2.0)
    field = bake(scene, rays=256)
    np.testing.assert_allclose(coefficients(field)[:, 0], 2.0 / Y00, rtol=1e-3)
    dimmed = build.scene([speck], world=1.0)
    assert dimmed.world.equirect.max() == 1.0
    relit = field.relight(replace(scene, world=dimmed.world))
    np.testing.assert_allclose(coefficients(relit)[:, 0], 1.0 / Y00, rtol=1e-3)


def test_a_scene_without_volumes_is_refused():
    with pytest.raises(BakeError, match="no probe volume"):
        bake(replace(build.closed_box(), volumes=()), **QUICK)


def test_distances_are_those_to_the_walls():
    """In the middle of a cube of half side 1, any direction ends between 1 and √3."""
    (grid,) = bake(build.closed_box(resolution=(1, 1, 1), half_size=1.0), **{**QUICK, "rays": 4096}).grids()
    # The clamp, 1.5 diagonals of a cell of 2 m, lies beyond.
    mean, square = grid.visibility[0, 0, 0, ..., 0], grid.visibility[0, 0, 0, ..., 1]
    assert mean.min() > 0.99 and mean.max() < np.sqrt(3) + 0.01
    assert np.all(square >= mean**2 * (1 - 1e-5)) and np.all(square < mean**2 * 1.1)


def test_volumes_keep_their_order_and_their_own_settings():
    box = build.closed_box()
    volumes = (replace(build.volume("a", (2, 1, 1), 0.4), settings={"order": 1, "rays": 32, "unknown": 5}),
               build.volume("b", (1, 2, 3), 0.3), replace(build.volume("c", (1, 1, 2), 0.2), settings={"order": 1, "rays": 32}))
    field = bake(replace(box, volumes=volumes), **QUICK)
    assert [grid.volume.name for grid in field.grids()] == ["a", "b", "c"]
    assert [grid.order for grid in field.grids()] == [1, 2, 1]
    assert [grid.validity.shape for grid in field.grids()] == [(1, 1, 2), (3, 2, 1), (2, 1, 1)]
    assert field.stats["probe_rays"] == 4 * 32 + 6 * 64
    assert all(grid.sh[..., 0, :].min() > 0 for grid in field.grids())


def test_volumes_of_one_name_are_not_confused():
    volumes = (build.volume("same", (2, 1, 1), 0.4), build.volume("same", (1, 1, 3), 0.3))
    field = bake(replace(build.closed_box(), volumes=volumes), **QUICK)
    assert [grid.sh.shape[:3] for grid in field.grids()] == [(1, 1, 2), (3, 1, 1)]


def test_a_volumes_own_setting_out_of_range_is_refused():
    volume = replace(build.volume(), settings={"order": 99})
    with pytest.raises(UsageError, match="order"):
        bake(replace(build.closed_box(), volumes=(volume,)), **QUICK)


def test_the_bar_moves_while_the_surface_cache_grows():
    """In a small bake that is most of the work, and it was a standstill at 7 %."""
    reported = []
    bake(build.closed_box(), progress=Progress(lambda fraction, label, _left: reported.append((fraction, label)), interval=0.0),
         error=0.05)
    growing = [fraction for fraction, label in reported if label.startswith("surface cache")]
    assert growing[0] < 0.2 and growing[-1] - growing[0] > 0.25
