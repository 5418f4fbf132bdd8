"""Media in the picture: closed forms of slices, slabs and lamps, what cannot be seen, and what nothing of it changes."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from media_scenes import GREY, Uniform, box, eye, ray, scene_of
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.effects.media import froxels
from rtgi_addon.effects.media.along import NUMBERS, MediaAlong
from rtgi_addon.effects.media.ambient import scattered
from rtgi_addon.effects.media.froxels import BEND, Columns, Presence, Shape, shape_of
from rtgi_addon.effects.media.history import share_before
from rtgi_addon.effects.media.integrate import Slices, gather, seen_through
from rtgi_addon.effects.media.lighting import Surroundings, falloff_beyond
from rtgi_addon.numerics import sh
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import ClosedMesh, DensityGrid, Instance, Medium, Phase, PointLight, SunLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.media.phase import phase_moments, phase_value
from rtgi_addon.transport.media.table import MediaTable
from rtgi_addon.transport.paths.scattering import walk
from rtgi_addon.transport.paths.sources import Sources

MEDIA = get("media")


def test_slices_add_up_to_the_integral_however_few_they_are():
    # A source S a metre over d: S·(1 − e^(−σd))/σ; the naive S·d is 1.582 times it at τ = 1.
    for tau in (1e-6, 0.1, 1.0, 5.0):
        for count in (1, 7):
            shape = (count, 1, 1, 3)
            slices = Slices(np.full(shape, tau / count, np.float32), np.full(shape, 2.0 / count, np.float32),
                            np.zeros(shape, np.float32), *np.zeros((2, count, 1, 1), np.float32))
            assert gather(slices).direct[-1] == pytest.approx(2.0 * -np.expm1(-tau) / tau, rel=2e-6)


def test_limits_and_places_among_them_agree():
    shape = Shape((7, 5), 2, 12, 1.5, 60.0)
    assert shape.columns == (4, 3) and shape.limits[0] == np.float32(1.5) and shape.limits[-1] == pytest.approx(60.0, rel=1e-6)
    assert np.allclose(shape.slice_of(shape.limits), np.arange(13), atol=1e-4)
    assert np.array_equal(shape.slice_of(np.float32([0.0, 1e10])), [0, 12])
    growth = np.diff(shape.limits)
    assert np.allclose(growth[1:] / growth[:-1], (1 / BEND + 1) ** (1 / 12), rtol=1e-4)


@pytest.mark.parametrize("slices", [4, 5, 64])
def test_a_slab_leaves_the_same_light_by_any_number_of_slices(slices):
    """e^(−σd), to the surface that is in the middle of it, too."""
    slab = Medium("slab", 0.3 * GREY, np.array([0.1, 0.4, 0.9]), bounds=box((2, -5, -5), (4.5, 5, 5)))
    for wall, length in ((None, 2.5), (3.1, 1.1)):
        left = ray(scene_of([slab], world=1.0, wall=wall), slices=slices)[1]
        assert left == pytest.approx(np.exp(-slab.extinction * length), rel=1e-5)


def test_fog_takes_all_of_a_world_and_its_share_of_a_wall():
    fog = Medium("fog", 0.1 * GREY, 0.1 * GREY)
    assert not ray(scene_of([fog], world=1.0))[0].any()
    assert ray(scene_of([fog], world=1.0, wall=5.0))[1] == pytest.approx(np.exp(-1.0), rel=1e-5)


def test_a_shaft_of_sun():
    """(σ_s/σ_t)·p·E·(1 − e^(−σ_t·d)) across the sun; Rayleigh sends 3/16π there."""
    sun = SunLight("sun", np.array([0.0, 0, -1]), np.ones(3))
    for phase, value in ((Phase(), 1 / (4 * np.pi)), (Phase("RAYLEIGH"), 3 / (16 * np.pi))):
        shaft = Medium("shaft", 0.5 * GREY, 0.3 * GREY, phase=phase, bounds=box((2, -1, -1e-4), (4, 1, 1e-4)))
        found = ray(scene_of([shaft], [sun]))[2]
        assert found == pytest.approx(0.5 / 0.8 * value * -np.expm1(-1.6), rel=1e-3)


@pytest.mark.parametrize("slices", [8, 64])
def test_a_point_light_in_a_thin_medium(slices):
    """σ_s·I/(4h) along an infinite ray at the distance h from it; of a part (atan(b/h) − atan(a/h))/π of that. Exact by the few
    slices of 60 m, however close the lamp."""
    lamp = PointLight("lamp", np.float32([5, 0.02, 0]), np.ones(3), casts_shadow=False)
    haze = Medium("haze", 1e-5 * GREY, bounds=box((0, -9, -9), (60, 9, 9)))
    found = ray(scene_of([haze], [lamp]), slices=slices)[2]
    expected = 1e-5 / (4 * np.pi * 0.02) * (np.arctan(55 / 0.02) + np.arctan(5 / 0.02))
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("reach", [1e-3, 0.5, 2.0, 9.0])
def test_the_falloff_over_a_part_of_a_ray_is_its_mean(reach):
    rng = np.random.default_rng(5)
    distance, cosine = rng.uniform(0.1, 3, 50), rng.uniform(-0.99, 0.99, 50)
    first, last = -rng.uniform(0, 2, 50), rng.uniform(0.1, 2, 50)
    t = first[:, None] + (last - first)[:, None] * (np.arange(4000) + 0.5) / 4000
    squared = distance[:, None] ** 2 + t * t - 2 * t * (distance * cosine)[:, None]
    beyond = (1 - np.maximum(1 - squared / reach**2, 0) ** 2) / squared
    found = falloff_beyond(distance, distance * cosine, first, last, reach)
    assert np.allclose(found, np.mean(distance[:, None] ** 2 * beyond, axis=1), rtol=2e-3)


@pytest.mark.parametrize("radius,soft,close,slack", [(0.0, True, 0.01, 5e-3), (0.05, False, 0.08, 0.02), (0.05, True, 0.03, 0.03),
                                                     (0.4, False, 0.3, 0.05)])
def test_lamps_of_any_size_in_wide_columns_give_what_they_give(monkeypatch, radius, soft, close, slack):
    """In haze by the integral of the irradiance that a point, a disk that faces the ray's points, or a ball makes along it: within
    and beyond 20 cm about the lamp, of which what is wide (40 cm) takes no notice."""
    monkeypatch.setattr(froxels, "NEAR", 0.2 / 1e-5)
    lamp = PointLight("lamp", np.float32([5, close, 0]), np.ones(3), radius=radius, soft_falloff=soft, casts_shadow=False)
    haze = Medium("haze", 1e-5 * GREY, bounds=box((0, -9, -9), (10, 9, 9)))
    t = 10 * (np.arange(200000) + 0.5) / 200000
    d = np.hypot(t - 5, close)
    cap = radius / np.maximum(d, radius or 1)
    ball = np.where(cap < 1, 2 * (1 - np.sqrt(1 - cap**2)), 4) / (radius or 1) ** 2
    given = 1 / d**2 if radius == 0 else 2 / radius**2 * (1 - d / np.hypot(d, radius)) if soft else ball
    found = ray(scene_of([haze], [lamp]), slices=96, samples=48)[2]
    assert found == pytest.approx(1e-5 / (4 * np.pi) * 10 * given.mean(), rel=slack)


def test_a_point_light_in_fog():
    """B. Sun et al., "A Practical Analytic Single Scattering Model for Real Time Rendering", 2005: β 0.4, lamp at 3 m under the
    angle 0.7 to the ray, 6 m of it."""
    lamp = PointLight("lamp", np.float32([3 * np.cos(0.7), 3 * np.sin(0.7), 0]), np.ones(3))
    found = ray(scene_of([Medium("fog", 0.4 * GREY)], [lamp], wall=6.0), samples=64)[2]
    assert found == pytest.approx(0.0052979277, rel=5e-3)


def test_height_fog():
    """σ₀·e^(−bz): τ = σ₀·e^(−bz₀)·(1 − e^(−b·d_z·D))/(b·d_z); .3, .25, z₀ 1, d_z .4 over 7 m is 1.1761793."""
    low, high = -2.0, 8.0
    z = low + (high - low) * (np.arange(200) + 0.5) / 200
    matrix = build.transform((4, 0, 3), (10, 5, 5))
    grid = DensityGrid(matrix, np.ascontiguousarray(np.broadcast_to(np.exp(-0.25 * z)[:, None, None], (200, 2, 2)), np.float32))
    towards = np.array([np.sqrt(1 - 0.16), 0, 0.4])
    fog = Medium("fog", absorption=0.3 * GREY, grid=grid)
    scene = scene_of([fog], world=1.0, wall=7 * towards[0])
    left = ray(scene, samples=4, seen_by=eye((0, 0, 1), towards))[1]
    assert -np.log(left) == pytest.approx(1.1761793, rel=2e-3)


def test_a_medium_that_only_scatters_cannot_be_seen_in_a_uniform_field():
    """White fog before a wall as bright as the light around it."""
    for phase in (Phase(), Phase(anisotropy=0.7), Phase("MIE", diameter=10.0)):
        found = ray(scene_of([Medium("fog", 0.6 * GREY, phase=phase)], wall=4.0), Uniform(0.5))
        # The wall reflects half of the irradiance π·0.5.
        assert found[3] == pytest.approx(0.5 * -np.expm1(-2.4), rel=1e-5)
        assert found[0] == pytest.approx(0.25 * np.exp(-2.4) + 0.5 * -np.expm1(-2.4), rel=1e-5)


def test_forward_scattering_is_brighter_towards_the_light():
    fog = Medium("fog", 0.1 * GREY, phase=Phase(anisotropy=0.6), bounds=box((-9, -9, -9), (9, 9, 9)))
    lamp = PointLight("lamp", np.float32([8, 0.5, 0]), np.ones(3))
    for scene, field, which in ((scene_of([fog], [lamp]), None, 2), (scene_of([fog]), Uniform(1.0, (0.2, 1.0)), 3)):
        towards, away = (ray(scene, field, samples=4, seen_by=eye((0.1, 0, 0), (side, 0, 0)))[which] for side in (1, -1))
        assert np.all(towards > 2 * away)


@pytest.mark.parametrize("g, kept", [(0.2, 0.96), (0.5, 0.625), (0.8, 0.147), (0.9, 0.041)])
def test_harmonics_keep_so_much_of_a_forward_peak(g, kept):
    """Why lamps go by the phase functions themselves: of a narrow beam order 2 keeps this share of Henyey and Greenstein's peak,
    and order 1 is below 0 over a sixth of all directions at g = 0.5, where what is scattered is 0."""
    phase, beam = Phase(anisotropy=g), np.float32([[0.6, 0, 0.8]])
    light = sh.evaluate(beam, 2)[:, :, None].astype(np.float32)
    peak = phase_value(phase, np.ones(1))[0]
    assert scattered(light, beam, phase_moments(phase, 2))[0, 0] / peak == pytest.approx(kept, rel=0.01)
    if g == 0.5:
        light[:, 4:] = 0
        around = fibonacci_sphere(4096)
        found = scattered(np.repeat(light, len(around), axis=0), around, phase_moments(phase, 2))[:, 0]
        assert np.mean(found == 0) == pytest.approx(1 / 6, abs=1e-3)


def test_of_a_lamp_media_scatter_the_share_that_it_says():
    """In the picture, along rays, and at the turns of walks; what surfaces get is the same."""
    fog = Medium("fog", 0.2 * GREY, bounds=box((2, -1, -1), (4, 1, 1)))
    found = []
    for share in (1.0, 0.25, 0.0):
        scene = scene_of([fog], [PointLight("lamp", np.float32([3, 0.5, 3]), np.ones(3), scattered=share)], wall=6.0)
        context = LightContext(scene, whole=True)
        rays = np.zeros((64, 3), np.float32), np.tile(np.float32([1, 0, 0]), (64, 1)), np.full(64, 6.0)
        u = np.random.default_rng(1).random((64, NUMBERS), np.float32)
        along = MediaAlong(Surroundings.of(scene, context, None)).light(*rays, u)
        walks = walk(context, Sources(context), *rays, np.arange(64, dtype=np.uint32))
        frame = draw_frame(scene, None, eye(), (1, 1))
        MEDIA.apply(frame, None, MEDIA.Settings(tile=1))
        found.append((frame.passes["volume_direct"][0, 0, :3], along.mean(axis=0), walks.gained.mean(axis=0), frame.direct[0, 0]))
    whole, quarter, nothing = found
    for one, part, none in zip(whole[:3], quarter, nothing, strict=False):
        assert np.all(one > 0) and part == pytest.approx(0.25 * one, rel=1e-4) and not none.any()
    assert np.array_equal(whole[3], nothing[3]) and whole[3].any()


def test_media_shadow_themselves_and_surfaces_shadow_them():
    box_ = box((2, -1, -1), (4, 1, 1))
    sun = SunLight("sun", np.array([0.0, 0, -1]), np.ones(3))
    # At the middle of a box a metre of it is above.
    medium = Medium("box", 0.5 * GREY, bounds=box_)
    lit = ray(scene_of([medium], [sun]))[2]
    assert lit == pytest.approx(np.exp(-0.5) / (4 * np.pi) * -np.expm1(-1.0), rel=1e-3)
    roof = build.plane("roof", 50.0, z=2.0)
    covered = scene_of([medium], [sun])
    covered = replace(covered, meshes=(*covered.meshes, roof), instances=(*covered.instances, Instance("roof", 1, np.eye(4))))
    assert not ray(covered)[2].any()
    unshadowed = replace(covered, lights=(replace(sun, casts_shadow=False),))
    assert ray(unshadowed)[2] == pytest.approx(1 / (4 * np.pi) * -np.expm1(-1.0), rel=1e-3)


def test_emission_is_seen_without_extinction():
    glow = Medium("glow", emission=np.array([0.3, 0.1, 0.0]), bounds=box((2, -1, -1), (4, 1, 1)))
    assert ray(scene_of([glow]))[2] == pytest.approx([0.6, 0.2, 0.0], rel=1e-5)


def test_media_that_overlap_add_up_and_what_the_camera_does_not_see_is_left_out():
    one = Medium("one", absorption=0.2 * GREY, bounds=box((1, -1, -1), (3, 1, 1)))
    other = Medium("other", absorption=0.4 * GREY, bounds=box((2, -1, -1), (4, 1, 1)))
    assert ray(scene_of([one, other], world=1.0))[1] == pytest.approx(np.exp(-1.2), rel=1e-5)
    hidden = replace(other, visible_camera=False)
    assert ray(scene_of([one, hidden], world=1.0))[1] == pytest.approx(np.exp(-0.4), rel=1e-5)


def test_orders_and_range_are_limits():
    fog = Medium("fog", 0.1 * GREY)
    scene = scene_of([fog], wall=10.0)
    assert not ray(scene, Uniform(), orders="lamps")[3].any() and ray(scene, Uniform())[3].all()
    assert ray(scene, reach=4.0)[1] == pytest.approx(np.exp(-0.4), rel=1e-5)


def test_a_picture_without_media_is_left_alone():
    frame = draw_frame(stage(), None, view(), SIZE)
    assert MEDIA.apply(frame, None, MEDIA.Settings()) is frame.light and not frame.passes


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
def test_passes_make_up_the_picture(orthographic, transparent):
    fog = Medium("fog", 0.1 * GREY, 0.1 * GREY, bounds=box((-1, -1, 0), (1, 1, 1.5)))
    scene = replace(stage(), media=(fog,))
    frame = draw_frame(scene, Uniform(0.3), view(orthographic=orthographic), SIZE, transparent=transparent)
    light = MEDIA.apply(frame, Uniform(0.3), MEDIA.Settings(tile=2))
    left, direct, indirect = (frame.passes[name][..., :3] for name in ("transmittance", "volume_direct", "volume_indirect"))
    assert np.allclose(light[..., :3], frame.light[..., :3] * left + direct + indirect, atol=1e-6)
    assert direct.any() and indirect.any() and left.min() > 0.2 and np.any(left < 0.95) and np.all(left <= 1)
    clear = ~frame.gbuffer.seen
    assert np.allclose(light[clear][:, 3], 1 - left[clear].mean(axis=1) if transparent else 1.0, atol=1e-6)
    again = apply_all(frame, Uniform(0.3), [Chosen(MEDIA, MEDIA.Settings(tile=2))])
    assert np.array_equal(again.light, light) and again.passes is frame.passes


def test_nothing_but_media_is_a_picture_too():
    lamp = PointLight("lamp", np.float32([3, 1.5, 0]), np.ones(3))
    smoke = Medium("smoke", 0.3 * GREY, bounds=box((2, -1, -1), (4, 1, 1)))
    with_surface, without = scene_of([smoke], [lamp]), replace(scene_of([smoke], [lamp]), instances=())
    assert np.allclose(ray(with_surface), ray(without), rtol=1e-5)


def test_a_closed_mesh_that_is_no_box_and_a_grid_are_where_they_are():
    ball = build.sphere("ball", 1.0, 3)
    media = [Medium("ball", absorption=GREY, bounds=ClosedMesh(ball.vertices_local, ball.triangles, build.transform((4, 0, 0))))]
    left = ray(scene_of(media, world=1.0))[1]
    assert left == pytest.approx(np.exp(-2.0), rel=0.02)
    shape = shape_of(scene_of(media), eye(), (1, 1), 1, 16, None)
    columns = Columns.of(shape, eye(), 0, (0.0, 0.0))
    presence = Presence.of(list(MediaTable(media).fillings), columns)
    assert presence.length[0].sum() == pytest.approx(2.0, rel=0.02)
    assert np.all(presence.leave >= presence.enter)


def test_a_large_volume_is_added_up_as_in_double_precision():
    shape = Shape((1280, 720), 8, 64, 0.0, 50.0)
    rng = np.random.default_rng(0)
    depth, direct, indirect = (rng.random((64, 90, 160, 3), np.float32) * np.float32(0.05) for _ in range(3))
    # Slices so thin that 1 − e^(−τ) loses its digits, too.
    depth[::3] *= np.float32(1e-4)
    limits = np.broadcast_to(shape.limits[:, None, None], (65, 90, 160))
    gathered = gather(Slices(depth, direct, indirect, limits[:-1], limits[1:]))
    whole = np.cumsum(depth, axis=0, dtype=np.float64)
    share = np.exp(-(whole - depth)) * -np.expm1(-depth.astype(np.float64)) / depth
    np.testing.assert_allclose(gathered.depth[-1], whole[-1], rtol=1e-5)
    for found, light in ((gathered.direct, direct), (gathered.indirect, indirect)):
        np.testing.assert_allclose(found[-1], np.sum(light * share, axis=0), rtol=1e-5)
    assert np.isfinite(seen_through(gathered, shape, np.float32([0.5, 0.5]), np.full((720, 1280), 30.0)).direct).all()


def drawn(scene, seen, history=None, index=0, **settings):
    """A frame with the picture after media, and a history for the next one."""
    frame = draw_frame(scene, None, seen, SIZE, index=index, history=history)
    return apply_all(frame, None, [Chosen(MEDIA, MEDIA.Settings(tile=2, **settings))])


def shafts(lamp=(0.3, 0.2, 2.0)):
    """Light through a grating into fog."""
    bars = build.plane("bars", 0.08, z=1.2)
    fog = Medium("fog", 0.3 * GREY, bounds=box((-1, -1, 0), (1, 1, 1.2)))
    scene = replace(stage([PointLight("lamp", np.float32(lamp), np.float32([9, 9, 9]))], 0.0), media=(fog,))
    places = [build.transform((0.25 * x, 0, 0), (1, 10, 1)) for x in range(-3, 4)]
    return replace(scene, meshes=(*scene.meshes, bars), instances=(*scene.instances, *(
        Instance(f"bar {number}", 2, place) for number, place in enumerate(places))))


def test_a_moving_view_goes_on_from_the_light_before():
    scene = shafts()
    path = [view((0.02 * step, -3.4, 2.2)) for step in range(12)]
    exact = np.mean([drawn(scene, path[-1], index=index, steady=False).passes["volume_direct"] for index in range(64)], axis=0)
    errors = {}
    for steady in (False, True):
        history = None
        for seen in path:
            frame = drawn(scene, seen, history, steady=steady)
            history = frame.history
        errors[steady] = np.sqrt(np.mean((frame.passes["volume_direct"] - exact) ** 2))
    assert exact[..., :3].max() > 0.01 and errors[True] < 0.6 * errors[False]


def test_nothing_trails_behind_a_moving_lamp():
    history = None
    for step in range(5):
        scene = shafts((0.3 - 0.1 * step, 0.2, 2.0))
        frame = drawn(scene, view(), history)
        history = frame.history
    assert np.array_equal(frame.light, drawn(scene, view()).light)


def test_a_still_picture_settles_on_its_own_samples():
    scene, first = shafts(), None
    for step in range(4):
        first = drawn(scene, view((0.3 * step, -3.4, 2.2)), first).history
    number = first.frame.kept["media"].number
    assert number == 3 and first.frame.kept["media"].count == 4
    # From the sixteenth sample on nothing before it counts.
    after = drawn(scene, view(), first, index=16)
    assert np.array_equal(after.passes["volume_direct"][..., 3], np.ones(SIZE[::-1]))
    assert share_before(4, 0) == pytest.approx(0.8) and share_before(4, 16) == share_before(15, 20) == 0 == share_before(0, 0)
    raw = drawn(scene, view(), index=16).passes["volume_direct"]
    found = after.passes["volume_direct"]
    assert np.abs(found - raw).max() > 0 and found.mean() == pytest.approx(raw.mean(), rel=0.1)


def test_light_along_any_rays_is_that_of_slices():
    """A lamp in thin haze by the closed form, and white fog in a uniform field, from one point a ray."""
    n = 1 << 13
    u = np.random.default_rng(2).random((n, NUMBERS), np.float32)
    rays = np.zeros((n, 3), np.float32), np.tile(np.float32([1, 0, 0]), (n, 1)), np.full(n, 10.0)
    lamp = PointLight("lamp", np.float32([5, 0.5, 0]), np.ones(3))
    several = [replace(lamp, name=f"lamp {number}", intensity=np.full(3, 1 / 6)) for number in range(6)]
    for lamps in ([lamp], several):
        haze = scene_of([Medium("haze", 1e-4 * GREY)], lamps)
        along = MediaAlong(Surroundings.of(haze, LightContext(haze, whole=True), None)).light(*rays, u)
        assert along.mean() == pytest.approx(1e-4 / (4 * np.pi * 0.5) * 2 * np.arctan(5 / 0.5), rel=0.05)
    fog = scene_of([Medium("fog", 0.3 * GREY, 0.1 * GREY, 0.05 * GREY, Phase(anisotropy=0.5))])
    along = MediaAlong(Surroundings.of(fog, LightContext(fog, whole=True), Uniform(0.5))).light(*rays, u)
    assert np.allclose(along, (0.3 * 0.5 + 0.05) / 0.4 * -np.expm1(-4.0), rtol=1e-4)


def test_threads_change_nothing():
    found = [drawn_by(threads) for threads in (1, 3)]
    assert np.array_equal(*found)


def drawn_by(threads):
    """Shafts, by so many threads."""
    frame = draw_frame(shafts(), None, view(), SIZE, threads=threads)
    return MEDIA.apply(frame, None, MEDIA.Settings(tile=1))
