"""The technique rsm: probes, relighting, volumes' own settings, what it says it leaves out, and bad input."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from shadow_maps import prepared

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, Cancelled
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.numerics import sh
from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.techniques.kernels import NumpyKernels
from rtgi_addon.techniques.rsm.gather import gather_every_texel
from rtgi_addon.techniques.rsm.settings import RsmSettings
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import probe_sh

RSM = techniques.get("rsm")
QUICK = {"resolution": 64, "samples": 100}


def bake(scene, seed=1, threads=None, progress=None, **settings):
    """A field of few texels and samples, unless ``settings`` say otherwise."""
    settings = RsmSettings(**{**QUICK, **settings})
    return RSM.bake(scene, settings, np.random.default_rng(seed), progress or Progress(), threads=threads)


def coefficients(field):
    """(p, k, 3) of all usable probes."""
    return np.concatenate([grid.sh[grid.usable] for grid in field.grids()])


def rms(values):
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))


def lit_by(*lights):
    """A closed box with these lamps."""
    return replace(build.closed_box(), lights=lights)


def test_probes_hold_the_first_bounce():
    scene = build.closed_box(0.5, light_position=(0.3, -0.2, 0.5), resolution=(3, 3, 3))
    field = bake(scene, every_texel=True, visibility=True)
    grid, = field.grids()
    assert grid.sh.shape == (3, 3, 3, 9, 3) and np.isnan(grid.standard_error).all() and grid.usable.all()
    axis = np.linspace(-1, 1, 3) / 3
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")[::-1], axis=-1).reshape(-1, 3).astype(np.float32)
    reference = probe_sh(LightContext(scene), points, 2, 4096, bounces=1)
    assert rms(grid.sh.reshape(-1, 9, 3) - reference.mean) < 0.02 * rms(reference.mean)


@pytest.mark.parametrize("settings", [{}, {"visibility": True}, {"every_texel": True}])
def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads(settings):
    scene = rooms.many_lamps(3)
    one, two, other = (coefficients(bake(scene, seed, threads, **settings)) for seed, threads in ((1, 1), (1, 2), (2, 1)))
    assert np.array_equal(one, two)
    assert np.array_equal(one, other) == settings.get("every_texel", False)


def test_a_texel_budget_holds_for_every_kind_of_lamp():
    scene = lit_by(build.point_light(), SunLight("sun", np.array([0, 0, -1.0]), np.ones(3)),
                   SpotLight("spot", np.zeros(3), np.array([0, 0, -1.0]), np.ones(3), 1.0),
                   AreaLight("area", np.zeros(3), np.array([0.1, 0, 0]), np.array([0, 0.1, 0]), np.array([0, 0, -1.0]), np.ones(3)))
    field = bake(scene)
    texels = np.bincount([item.view.lamp for item in field.maps], [item.primitive.size for item in field.maps])
    assert texels == pytest.approx(64**2, rel=0.1) and field.stats["rays"] == texels.sum()
    assert field.stats["maps"] == len(field.maps) == 6 + 1 + 1 + 20


def test_relighting_is_a_fresh_bake():
    scene = rooms.many_lamps(3)
    field = bake(scene)
    other = replace(scene, lights=(build.point_light((-0.4, 0.5, 0.6), (0.3, 1.5, 2.0)),))
    assert np.array_equal(coefficients(field.relight(other)), coefficients(bake(other)))
    assert np.array_equal(coefficients(field.relight(scene)), coefficients(field))
    with pytest.raises(BakeError, match="geometry"):
        field.relight(build.closed_box(half_size=3.0))


def test_a_slowly_moving_lamp_does_not_flicker():
    """Over steps of a tenth of a texel the light changes as a finer gather says, with little noise on top."""
    scene = build.closed_box(light_position=(0.2, 0.1, 0.3))
    field = bake(scene, resolution=128, samples=400)
    texel = 2.0 * 0.7 * np.sqrt(6) / 128
    frames = []
    for step in range(8):
        moved = replace(scene, lights=(build.point_light((0.2 + 0.1 * texel * step, 0.1, 0.3)),))
        frames.append(coefficients(field.relight(moved))[:, 0, 0])
    frames = np.array(frames)
    trend = np.polynomial.polynomial.Polynomial.fit
    noise = [np.std(row - trend(np.arange(8), row, 1)(np.arange(8))) / row.mean() for row in frames.T]
    assert max(noise) < 0.02


def test_a_volumes_own_settings_win():
    scene = build.closed_box()
    volumes = (replace(build.volume("coarse"), settings={"order": 1}), build.volume("fine"))
    field = bake(replace(scene, volumes=volumes))
    assert [grid.order for grid in field.grids()] == [1, 2] and [grid.volume.name for grid in field.grids()] == ["coarse", "fine"]
    own = replace(scene, volumes=(replace(build.volume(), settings={"resolution": 32, "every_texel": True}),))
    assert np.array_equal(coefficients(bake(own)), coefficients(bake(scene, resolution=32, every_texel=True)))


def test_it_says_what_it_leaves_out():
    lamp = build.point_light()
    assert len(bake(lit_by(lamp)).notes) == 1
    scene = replace(rooms.panel_room(), lights=(lamp, PointLight("ghost", np.zeros(3), np.ones(3), casts_shadow=False)))
    scene = replace(scene, world=build.scene([], world=1.0).world)
    field = bake(scene, visibility=True)
    text = "\n".join(field.notes)
    assert "light of the world" in text and "without shadows" not in text
    emission, shadows = field.omissions
    assert "gives off" in emission.text and emission.materials == ("glow",)
    assert "cast shadows" in shadows.text and shadows.objects == ("ghost",)
    away = SpotLight("lost", np.array([0, 0, 50.0]), np.array([0, 0, 1.0]), np.ones(3), 1.0)
    field = bake(lit_by(lamp, away))
    assert field.stats["unlit_lamps"] == ["lost"] and any("'lost'" in note for note in field.notes)
    assert field.params["bounces"] == 1 and field.params["light"] == "lamps"


def test_arrays_hold_every_map():
    field = bake(lit_by(build.point_light()))
    arrays = field.arrays()
    assert len(arrays) == 5 * 6 and arrays["map3.flux"] is field.maps[3].flux and '"lamp": 0' in str(arrays["map3.view"])


def test_kernels_may_take_over_capture_and_gather():
    calls = []

    class Counting(NumpyKernels):
        def capture(self, context, view):
            calls.append("capture")
            return super().capture(context, view)

        def rsm_gather(self, *arguments, **settings):
            calls.append("gather")
            return super().rsm_gather(*arguments, **settings)

    scene = build.closed_box(light_position=(0.3, -0.2, 0.5))
    bakes = [RSM.bake(scene, RsmSettings(resolution=64), np.random.default_rng(1), Progress(), kernels=kernels)
             for kernels in (None, Counting())]
    assert calls.count("capture") == 6 and "gather" in calls
    plain, counted = (coefficients(field) for field in bakes)
    # On a device probes come from irradiance over many normals.
    assert rms(plain - counted) < 0.02 * rms(plain)
    calls.clear()
    RSM.bake(scene, RsmSettings(resolution=64, visibility=True), np.random.default_rng(1), Progress(), kernels=Counting())
    assert "gather" not in calls


def bad_scenes():
    """Scenes that cannot be baked, with what the message must name."""
    dark = build.closed_box(intensity=0.0)
    above, up = np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, 1.0])
    ground = build.scene([build.plane("ground", 1.0)])
    return {
        "no lamp": (build.cube_furnace(), {}, "no lamp"),
        "a dark lamp": (dark, {}, "no lamp"),
        "a spot that points away": (replace(ground, lights=(SpotLight("away", above, up, np.ones(3), 1.0),)), {}, "'away'"),
        "an area lamp below, facing down": (replace(ground, lights=(AreaLight(
            "under", -above, np.array([0.1, 0, 0]), np.array([0, 0.1, 0]), -up, np.ones(3)),)), {}, "'under'"),
        "too many texels": (lit_by(*[build.point_light()] * 20), {"resolution": 2048}, "GiB"),
        "no volume": (replace(build.closed_box(), volumes=()), {}, "no probe volume"),
        "a resolution out of range": (build.closed_box(), {"resolution": 1}, "resolution"),
    }


@pytest.mark.parametrize("name", bad_scenes())
def test_bad_input_gives_one_clear_line(name):
    scene, settings, words = bad_scenes()[name]
    with pytest.raises(BakeError, match=words) as caught:
        bake(scene, **settings)
    assert caught.value.remedy and "\n" not in str(caught.value)


@pytest.mark.parametrize("position", [(1.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.0, 0.0, 3.0), (0.0, 0.0, 1e6)])
def test_lamps_on_walls_in_corners_and_outside_give_finite_numbers(position):
    field = bake(build.closed_box(light_position=position))
    assert np.isfinite(coefficients(field)).all()


def test_black_walls_reflect_nothing():
    assert not coefficients(bake(build.closed_box(albedo=0.0))).any()


def test_a_sun_over_a_large_ground_is_focused_on_the_volumes():
    scene = build.scene([build.plane("ground", 500.0)], [build.material("ground", 0.5)],
                        [SunLight("sun", np.array([0.0, 0.0, -1.0]), np.ones(3))], volumes=[build.volume(center=(100, 50, 1.0))])
    item, = bake(scene, resolution=256).maps
    assert 2.0 / item.view.clip_from_view[0, 0] < 6.0 and item.view.project(np.array([[100.0, 50.0, 0.0]]))[0][0] == \
        pytest.approx(0.5, abs=0.1)
    whole, = bake(scene, resolution=256, focus=1000.0).maps
    assert 2.0 / whole.view.clip_from_view[0, 0] > 1200.0


def test_cancelling_stops_it():
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        bake(rooms.many_lamps(3), progress=progress)


def test_the_bundle_holds_it(tmp_path):
    summary = bake_scene(build.closed_box(), "rsm", QUICK, tmp_path / "bundle")
    assert summary.technique == "rsm" and any("first bounce" in note for note in summary.notes)
    grid, = read_bundle(tmp_path / "bundle").grids
    assert sh.order_of(grid.sh.shape[3]) == 2 and grid.sh[..., 0, :].min() > 0


def test_cancelling_is_felt_in_the_middle_of_a_long_sum():
    """The wish comes with the first texels summed: the gather of one block of probes must not go on to its end."""
    progress, calls = Progress(), []

    class Tracer:
        def transmittance(self, origins, directions, limits):
            calls.append(len(origins))
            progress.cancel()
            return np.ones((len(origins), 1), np.float32)

    _, maps = prepared(build.closed_box(), 128)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (64, 3)).astype(np.float32)
    with pytest.raises(Cancelled):
        gather_every_texel(maps, points, None, order=1, tracer=Tracer(), threads=1, progress=progress)
    assert sum(calls) < 0.5 * 64 * sum(len(item.lit) for item in maps)
