"""Live probes: the exact answers of hysteresis, the first frame as a bake, closed forms, what moves, and who rests."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World
from rtgi_addon.techniques.probes import bake as probe_bake
from rtgi_addon.techniques.probes.live import LiveProbes, LiveSettings
from rtgi_addon.techniques.probes.live.lattice import NAP
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.transport.cache import surface_cache
from rtgi_addon.transport.cache.bright import BrightSurfaces
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.moving import MovingTracers

NO_BOUNCE = ProbeSettings(bounces=0)


def run(live, frames):
    for _ in range(frames):
        live.frame()
    return live.field.grids()[0].sh


def bytes_of(live):
    return [grid.sh.tobytes() + grid.visibility.tobytes() for grid in live.field.grids()]


def under_sky(radiance, **volume):
    options = {"center": (0, 0, 3.0), "resolution": (1, 1, 1), **volume}
    return build.open_plane(albedo=0.0, world=radiance, half_size=1e-3, **options)


def settle(live, most=2000):
    frames = 0
    while not live.settled and frames < most:
        live.frame()
        frames += 1
    assert live.settled
    return frames


@pytest.mark.parametrize("scene", [rooms.panel_room(), rooms.courtyard()], ids=["an emitter", "a sky with a sun"])
def test_the_first_frame_is_a_bake_with_as_many_rays_and_the_same_seed(scene):
    settings = ProbeSettings(rays=128, bounces=0)
    live = LiveProbes(scene, LiveSettings(rays=1 << 20, rays_per_probe=128, probes=settings), seed=3)
    live.frame()
    baked = techniques.get("probes").bake(scene, settings, np.random.default_rng(3), Progress()).grids()[0]
    found = live.field.grids()[0]
    np.testing.assert_allclose(found.sh, baked.sh, atol=2e-6 * np.abs(baked.sh).max())
    np.testing.assert_allclose(found.visibility, baked.visibility, atol=1e-6)
    assert np.array_equal(found.offset_world, baked.offset_world) and np.array_equal(found.validity, baked.validity)


def test_the_first_frame_is_a_bake_with_one_bounce_of_lamps(monkeypatch):
    """Where the bake takes light at the hits as well: not from texels, and without samples of what is brightly lit."""
    monkeypatch.setattr(probe_bake, "LEAST_SMOOTHNESS", 0.0)
    monkeypatch.setattr(probe_bake, "MOST_SMOOTHNESS", 0.0)
    monkeypatch.setattr(surface_cache, "find_bright", lambda context, *_: BrightSurfaces(context))
    scene = build.closed_box(0.6, light_position=(0.3, -0.2, 0.5), resolution=(3, 3, 3))
    live = LiveProbes(scene, LiveSettings(rays=1 << 20, rays_per_probe=128, probes=ProbeSettings(rays=128)), seed=5)
    live.frame()
    baked = techniques.get("probes").bake(scene, ProbeSettings(rays=128, bounces=1), np.random.default_rng(5), Progress())
    np.testing.assert_allclose(live.field.grids()[0].sh, baked.grids()[0].sh, atol=2e-6)


def test_a_change_is_followed_by_one_minus_the_power_of_the_hysteresis():
    """22.8, 75.6 and 151 frames to 50, 90 and 99 % for 0.97; and back, light decays by the same power."""
    live = LiveProbes(under_sky(0.0), LiveSettings(hysteresis=0.97, rays_per_probe=8, probes=NO_BOUNCE))
    run(live, 40)
    assert live.follow(under_sky(2.0))
    full = 2.0 * np.sqrt(4.0 * np.pi)
    share = np.array([run(live, 1)[0, 0, 0, 0, 0] / full for _ in range(160)])
    np.testing.assert_allclose(share, 1.0 - 0.97 ** np.arange(1, 161), atol=2e-6)
    frames = np.interp([0.5, 0.9, 0.99], share, np.arange(1, 161))
    np.testing.assert_allclose(frames, [22.8, 75.6, 151.2], atol=0.06)
    live.follow(under_sky(0.0))
    dark = np.array([run(live, 1)[0, 0, 0, 0, 0] for _ in range(20)])
    np.testing.assert_allclose(dark / dark[0], 0.97 ** np.arange(20), rtol=1e-5)


@pytest.mark.parametrize("hysteresis", [0.9, 0.97])
def test_the_steady_variance(hysteresis):
    """(1 − h)/(1 + h) of an update's: 0.0152 for 0.97, the noise of 65.7 updates; and the mean stays what it is."""
    scene = under_sky(1.0, resolution=(4, 4, 4))
    live = LiveProbes(scene, LiveSettings(hysteresis=hysteresis, probes=NO_BOUNCE))
    lattice, rng = live._lattices[0], np.random.default_rng(0)
    probes = np.flatnonzero(lattice.placement.measured)
    blended = []
    for frame in range(360):
        shape = len(probes), *lattice.light.shape[1:]
        lattice.wake()
        lattice.blend(probes, rng.normal(1.0, 1.0, shape).astype(np.float32), np.ones((len(probes), 64, 2), np.float32),
                      np.ones((len(probes), 64), np.float32))
        if frame >= 200 and frame % 30 == 0:
            blended.append(lattice.light[probes].copy())
    steady = (1.0 - hysteresis) / (1.0 + hysteresis)
    assert np.var(blended) == pytest.approx(steady, rel=0.03)
    assert np.mean(blended) == pytest.approx(1.0, abs=0.002)
    assert lattice.worth[probes] == pytest.approx(1.0 / steady, rel=1e-3)
    assert np.mean(lattice.spread[probes]) == pytest.approx(27.0, rel=0.05)


def test_the_mean_over_frames_is_the_bake():
    """A still scene seen by rays that are few: what gathers is unbiased, and says how far it may be off."""
    scene = rooms.panel_room()
    exact = techniques.get("probes").bake(scene, ProbeSettings(bounces=0, error=0.002), np.random.default_rng(9), Progress())
    errors, scores = [], []
    for seed in range(5):
        live = LiveProbes(scene, LiveSettings(rays_per_probe=8, noise=1e-4, probes=NO_BOUNCE), seed)
        run(live, 100)
        found = live.field.grids()[0]
        errors.append((found.sh - exact.grids()[0].sh)[found.usable])
        scores.append(errors[-1] / found.standard_error[found.usable][:, None, None])
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(1.0, abs=0.3)
    assert np.sqrt(np.mean(np.mean(errors, axis=0) ** 2)) < 1.6 * np.sqrt(np.mean(np.square(errors)) / 5)


def test_bounces_come_by_themselves():
    """The integrating sphere: Φ/(4πR²)·ρ/(1 − ρ) of indirect light, one bounce a frame."""
    scene = build.integrating_sphere(0.5, subdivisions=3, resolution=(3, 3, 3), half_size=0.5)
    live = LiveProbes(scene, LiveSettings(hysteresis=0.8, probes=ProbeSettings()))
    points = np.eye(3, dtype=np.float32) * 0.9
    first = (run(live, 1), live.field.irradiance(points, -np.eye(3, dtype=np.float32)).mean())[1]
    settle(live)
    settled = live.field.irradiance(points, -np.eye(3, dtype=np.float32))
    assert first == pytest.approx(np.pi / 2, rel=0.04)
    assert settled == pytest.approx(np.pi, rel=0.03)


def test_the_furnace():
    scene = build.cube_furnace(0.5, emission=1.0, resolution=(2, 2, 2))
    live = LiveProbes(scene, LiveSettings(hysteresis=0.8, rays_per_probe=256))
    run(live, 60)
    inward = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    assert live.field.irradiance(-0.99 * inward, inward).mean() == pytest.approx(2.0 * np.pi, rel=0.006)


def room_with_block(shift=0.0, **lamp):
    room, block = build.cube("room", 1.0, inward=True), build.cube("block", 0.25)
    scene = build.scene([room, block], lights=(build.point_light((0.3, -0.2, 0.7), **lamp),),
                        volumes=(build.volume(resolution=(5, 5, 5), half_size=0.95),))
    moved = replace(scene.instances[1], world_from_local=build.transform((-0.5 + shift, 0.1, -0.4)))
    return replace(scene, instances=(scene.instances[0], moved))


def test_what_moves_is_followed():
    """The light of another place, and who stands in the block there: as probes that never saw it elsewhere."""
    live = LiveProbes(room_with_block(), LiveSettings(hysteresis=0.8, rays=1 << 20, noise=0.03))
    run(live, 8)
    for shift in (0.2, 0.5, 0.9):
        assert live.follow(room_with_block(shift))
        live.frame()
    fresh = LiveProbes(room_with_block(0.9), LiveSettings(hysteresis=0.8, rays=1 << 20, noise=0.03), seed=4)
    settle(live), settle(fresh)
    one, other = live.field.grids()[0], fresh.field.grids()[0]
    assert np.array_equal(one.validity, other.validity) and np.array_equal(one.offset_world, other.offset_world)
    assert np.sqrt(np.mean((one.sh - other.sh) ** 2)) < 0.06 * np.sqrt(np.mean(other.sh**2))
    assert 0 < np.sum(~one.in_the_open) < 60


def test_surfaces_wait_until_frames_have_cost_as_much_and_come_at_last():
    live = LiveProbes(room_with_block(), LiveSettings(rays=1024, rays_per_probe=64))
    live._owed = 3000
    live.follow(room_with_block(0.3))
    assert not live.settled and live.scene is not None
    assert np.allclose(live.scene.instances[1].world_from_local[0, 3], -0.5)
    run(live, 4)
    assert np.allclose(live.scene.instances[1].world_from_local[0, 3], -0.2)


def test_a_tracer_of_what_moves_meets_what_a_new_one_does():
    rng, make = np.random.default_rng(0), MovingTracers()
    origins = rng.uniform(-0.9, 0.9, (4000, 3)).astype(np.float32)
    directions = rng.normal(size=(4000, 3)).astype(np.float32)
    built = []
    for shift in (0.0, 0.3, 0.3, 0.6, 0.6):
        scene = room_with_block(shift)
        hits = LightContext(scene, make=make).tracer.intersect(origins, directions)
        fresh = LightContext(scene).tracer.intersect(origins, directions)
        assert np.array_equal(hits.primitive, fresh.primitive)
        np.testing.assert_allclose(hits.t[hits.primitive >= 0], fresh.t[hits.primitive >= 0], rtol=1e-5)
        built.append(make.built)
    # The whole; the block and, once, the room without it; nothing; the block alone.
    assert np.diff([0, *built]).tolist() == [24, 24, 0, 12, 0]


def test_probes_rest_where_nothing_changes_and_wake_when_something_does():
    live = LiveProbes(room_with_block(), LiveSettings(hysteresis=0.8, noise=0.06))
    settle(live)
    before, frame = bytes_of(live), live.frame()
    assert frame.rays == frame.awake == 0 and bytes_of(live) == before
    live.follow(room_with_block(intensity=2.0))
    assert not live.settled and live.frame().awake > 0 and bytes_of(live) != before


def test_probes_that_no_surface_reads_take_a_turn_now_and_then():
    scene = build.closed_box(resolution=(12, 12, 12), half_size=0.97)
    scene = replace(scene, volumes=(build.volume(resolution=(12, 12, 12), half_size=0.97),))
    live = LiveProbes(scene, LiveSettings(rays=1 << 22, rays_per_probe=8))
    lattice = live._lattices[0]
    unread = ~lattice.read
    assert 0.05 < unread.mean() < 0.6
    run(live, NAP + 1)
    assert np.all(lattice.age[unread] == 2) and np.all(lattice.age[~unread & lattice.placement.measured] == NAP + 1)


def test_a_small_budget_takes_turns_and_threads_change_nothing():
    scene = room_with_block()
    one, other = (LiveProbes(scene, LiveSettings(rays=2048, rays_per_probe=32), threads=threads) for threads in (1, 3))
    seen = set()
    for _ in range(9):
        frame = one.frame()
        assert 0 < frame.rays <= 2048 and frame == other.frame()
        seen.add(frame.probes)
        assert bytes_of(one) == bytes_of(other)
    assert np.all(one._lattices[0].age[one._lattices[0].placement.measured] >= 1)
    # What had no turn counts as inside of something until then, and nothing is dark for it.
    begun = LiveProbes(scene, LiveSettings(rays=2048, rays_per_probe=32))
    begun.frame()
    lit = begun.field.irradiance(np.float32([[0.6, 0.6, -0.99]]), np.float32([[0, 0, 1]]))
    assert np.all(lit > 0)


def test_lamps_held_directly_are_followed_at_once():
    settings = LiveSettings(hysteresis=0.97, probes=ProbeSettings(direct=True, bounces=0))
    live = LiveProbes(room_with_block(), settings)
    before = run(live, 2)
    live.follow(room_with_block(intensity=3.0))
    assert live.field.direct_lamps == {"lamp"}
    np.testing.assert_allclose(run(live, 1), 3.0 * before, rtol=1e-4, atol=1e-6)


def test_another_lattice_begins_anew_and_what_cannot_be_followed_is_said():
    scene = room_with_block()
    live = LiveProbes(scene, LiveSettings(probes=ProbeSettings(bounces=3)))
    assert [note for note in live.notes if "limit of bounces" in note]
    run(live, 3)
    assert live.follow(replace(scene, volumes=(build.volume(resolution=(3, 2, 2), half_size=0.5),)))
    assert live.field.grids()[0].sh.shape[:3] == (2, 2, 3) and not live.follow(live.scene)
    with pytest.raises(BakeError, match="no probe volume"):
        live.follow(replace(scene, volumes=()))
    # And goes on with the next scene that has one.
    assert live.follow(replace(scene, world=World.constant(0.5)))
    assert live.frame().rays > 0
