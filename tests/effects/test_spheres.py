"""Sphere probes: closed forms of their maps and look-up, and bakes of rooms whose light is known."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from picture_stage import view

from rtgi_addon.effects import get
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.effects.spheres.bake import bake_spheres
from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes, influence, level_alpha, level_sides, parallax
from rtgi_addon.effects.spheres.prefilter import averaged, lobe, prefiltered
from rtgi_addon.effects.spheres.settings import SphereSettings
from rtgi_addon.numerics import octahedral
from rtgi_addon.numerics.sampling import about
from rtgi_addon.scene import AreaLight, Channel
from rtgi_addon.scene.checks import check_scene
from rtgi_addon.scene.sphere_probe import SphereProbe
from rtgi_addon.techniques import Field

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
SMALL = SphereSettings(resolution="32", rays=2)


class Even(Field):
    """The same irradiance everywhere."""

    technique = "even"

    def __init__(self, irradiance, direct_lamps=frozenset()):
        self._irradiance, self.direct_lamps, self.params, self.stats = irradiance, direct_lamps, {}, {}

    def irradiance(self, points, normals):
        return np.full(points.shape, self._irradiance, np.float32)

    def arrays(self):
        return {}


def at(x=0.0, y=0.0, z=0.0, name="probe", **options):
    options = {"influence_distance": 1.0, "parallax_distance": 1.0, "clip_start": 0.01, **options}
    return SphereProbe(name, build.transform((x, y, z)), **options)


def probes(*entries):
    """Probes with the maps that functions of directions make: (probe, function) each."""
    side, found = 64, []
    directions = octahedral.texel_directions(side).astype(np.float64)
    for probe, function in entries:
        levels = prefiltered(function(directions).reshape(1, side, side, 3))
        found.append(SphereMap(probe, tuple(level[0].astype(np.float16) for level in levels)))
    return SphereProbes(found)


def constant(value):
    return lambda directions: np.full(directions.shape, float(value))


def test_a_map_of_one_radiance_stays_that_at_every_level():
    levels = prefiltered(np.full((2, 64, 64, 3), 0.7))
    assert [len(level[0]) for level in levels] == level_sides(64) == [64, 32, 32, 32, 32, 32]
    assert max(np.abs(level - np.float32(0.7)).max() for level in levels) < 1e-6
    assert level_alpha(64, 5) == 1.0


def test_levels_are_the_lobe_s_mean_over_all_directions():
    """Against an integral by importance sampling of the same lobe, of a map with a small bright patch and a gradient."""
    rng = np.random.default_rng(1)

    def light(d):
        patch = np.exp(40.0 * (d @ np.array([0.6, 0.0, 0.8]) - 1.0))
        return np.stack([1.0 + d[..., 2], 0.3 + 4.0 * patch, 1.0 - 0.8 * d[..., 0]], axis=-1)

    found = probes((at(), light))
    directions = rng.normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for alpha in (0.125, 0.25, 0.5, 1.0):
        u = (np.arange(4096) + 0.5) / 4096, (np.arange(4096) * 0.618034) % 1.0
        cosine = np.sqrt((1.0 - u[0]) / (1.0 + (alpha**2 - 1.0) * u[0]))
        half = np.stack([np.sqrt(1 - cosine**2) * np.cos(2 * np.pi * u[1]), np.sqrt(1 - cosine**2) * np.sin(2 * np.pi * u[1]),
                         cosine], axis=1)
        mirrored = 2 * cosine[:, None] * half - [0, 0, 1]
        weight = np.maximum(mirrored[:, 2], 0.0)
        expected = np.stack([weight @ light(about(np.tile(direction, (4096, 1)), mirrored)) / weight.sum()
                             for direction in directions])
        seen, share = found.radiance(np.zeros((60, 3)), directions, alpha)
        assert np.sqrt(np.mean((seen - expected)**2)) < 0.02 * expected.mean() and np.all(share == 1)


def test_narrow_lobes_weigh_what_wide_ones_do_in_the_mean():
    """∫ D(h)·(n·l) dω is the same for both ways of writing it, and no weight is negative."""
    cosine = np.linspace(-1, 1, 101)
    assert np.all(lobe(cosine, 0.1) >= 0) and np.all(lobe(cosine[:50], 0.5) == 0) and lobe(np.array([1.0]), 0.5)[0] == 16.0


@pytest.mark.parametrize("matrix", [np.diag([2.0, 1.5, 1.0]), TURN @ np.diag([1.0, 2.0, 3.0])])
def test_a_box_room_s_parallax_is_exact(matrix):
    """Rays from any point in the box meet the wall that is seen from the centre in the direction that the look-up takes."""
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = matrix, (4.0, -1.0, 2.0)
    probe = SphereProbe("room", world, "box", 1.0, 0.1, "box", 1.0)
    rng = np.random.default_rng(2)
    start, wall = rng.uniform(-1, 1, (500, 3)), rng.uniform(-1, 1, (500, 3))
    start[250:, 2] = -1.0  # on the floor
    axis = rng.integers(0, 3, 500)
    wall[np.arange(500), axis] = np.where(axis == 2, 1.0, rng.choice([-1.0, 1.0], 500))
    points, walls = (unit @ matrix.T + world[:3, 3] for unit in (start, wall))
    directions = (walls - points) / np.linalg.norm(walls - points, axis=1)[:, None]
    towards, _ = parallax(probe, points, directions, np.zeros(500))
    assert np.abs(towards - (walls - world[:3, 3])).max() < 1e-9


def test_a_sphere_room_s_parallax_is_exact_and_lobes_change_width():
    probe = at(1.0, 2.0, 3.0, parallax_distance=2.0)
    rng = np.random.default_rng(3)
    walls = rng.normal(size=(100, 3))
    walls = 2.0 * walls / np.linalg.norm(walls, axis=1)[:, None]
    points = rng.uniform(-1, 1, (100, 3))
    way = np.linalg.norm(walls - points, axis=1)
    towards, width = parallax(probe, points + np.array([1, 2, 3]), (walls - points) / way[:, None], np.full(100, 0.2))
    assert np.abs(towards - walls).max() < 1e-9
    assert np.abs(width - 0.2 * way / 2.0).max() < 1e-9


def test_rays_that_miss_the_parallax_volume_come_from_afar():
    for shape in ("sphere", "box"):
        towards, width = parallax(at(parallax_shape=shape), np.array([[5.0, 0, 0], [5, 0, 0], [-5, 3, 0]]),
                                  np.array([[1.0, 0, 0], [0, 0, 1], [1, 0, 0]]), np.full(3, 0.3))
        assert np.array_equal(towards, [[1, 0, 0], [0, 0, 1], [1, 0, 0]]) and np.array_equal(width, np.full(3, 0.3))


def test_falloff_is_blender_s():
    points = np.array([[0.0, 0, 0], [0.8, 0, 0], [0.9, 0, 0], [1.0, 0, 0], [0.9, 0.9, 0]])
    assert influence(at(falloff=0.2), points) == pytest.approx([1, 1, 0.5, 0, 0])
    assert influence(at(falloff=0.2, influence_shape="box"), points) == pytest.approx([1, 1, 0.5, 0, 0.5])
    assert influence(at(falloff=0.0), points).tolist() == [1, 1, 1, 0, 0]


def test_shares_are_weights_the_smallest_probe_first():
    large, small = at(influence_distance=4.0, falloff=1.0), at(0.5, influence_distance=1.0, falloff=1.0)
    found = probes((large, constant(8.0)), (small, constant(2.0)))
    light, share = found.radiance(np.array([[0.5, 0, 0], [1.0, 0, 0], [9.0, 0, 0]]), np.eye(3), np.full(3, 0.5))
    half = 0.5 * 2.0 + 0.5 * 0.75 * 8.0
    assert light[:, 0] == pytest.approx([2.0, half, 0.0], abs=1e-5) and share == pytest.approx([1.0, 0.5 + 0.5 * 0.75, 0.0])


def test_looking_from_anywhere_along_anything_is_finite():
    rng = np.random.default_rng(4)
    points = np.concatenate([rng.normal(size=(200, 3)) * 3, np.zeros((3, 3)), np.eye(3), 0.0 * np.eye(3) + [1, 1, 1]])
    directions = np.concatenate([rng.normal(size=(200, 3)), np.eye(3), -np.eye(3), np.eye(3)])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for shape in ("sphere", "box"):
        found = probes((at(influence_distance=5.0, parallax_shape=shape), constant(1.0)))
        for alpha in (0.0, 1e-6, 0.3, 1.0):
            light, share = found.radiance(points, directions, np.full(len(points), alpha))
            assert np.all(np.isfinite(light)) and np.abs(light - share[:, None]).max() < 1e-3 and share.max() <= 1


def test_a_furnace_is_seen_as_one():
    """Every surface of albedo ρ and emission e shines with e/(1 − ρ), whatever mirrors there are."""
    room = replace(build.cube_furnace(0.5, 1.0), spheres=(at(0.3, -0.2, 0.1),))
    baked = bake_spheres(room, None, SMALL)
    assert not baked.notes and baked.rays >= 2 * 32 * 32
    assert max(np.abs(level.astype(float) - 2.0).max() for level in baked.probes.maps[0].levels) < 4e-3


def test_a_bake_is_the_same_for_any_number_of_threads():
    room = replace(build.closed_box(), spheres=(at(0.3, name="b"), at(-0.3, name="a")))
    one, other = (bake_spheres(room, None, SMALL, seed=3, threads=threads).probes for threads in (1, 3))
    assert all(np.array_equal(a, b) for x, y in zip(one.maps, other.maps, strict=True)
               for a, b in zip(x.levels, y.levels, strict=True))


def test_a_mirror_s_picture_is_in_it():
    """A perfect mirror wall of a room with one glowing wall shows that wall, where a dull one would be dark."""
    mirror = replace(build.material("mirror", 0.9), base_color=Channel.of(np.float32([1, 1, 1])), metallic=Channel.of(1.0),
                     roughness=Channel.of(0.0))
    glow = build.material("glow", 0.0, 3.0)
    left, right = (build.plane(name, 4.0, material_index=index) for index, name in enumerate(("mirror", "glow")))
    room = build.scene([left, right], [mirror, glow])
    stand = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], float)
    room = replace(room, instances=(replace(room.instances[0], world_from_local=build.transform((-1, 0, 0), rotation=stand)),
                                    replace(room.instances[1], world_from_local=build.transform((1, 0, 0), rotation=stand))),
                   spheres=(at(),))
    level = bake_spheres(room, None, SMALL).probes.maps[0].levels[0].astype(float)
    directions = octahedral.texel_directions(32).reshape(32, 32, 3)
    assert level[directions[..., 0] > 0.7].min() > 2.9 and level[directions[..., 0] < -0.7].mean() > 2.8
    dull = bake_spheres(room, None, replace(SMALL, reflections=0)).probes.maps[0].levels[0].astype(float)
    assert dull[directions[..., 0] < -0.7].mean() < 2.4


def test_lamps_are_seen_only_where_the_bake_holds_their_light():
    lamp = AreaLight("lamp", np.float32([0, 0, 0.5]), np.float32([0.4, 0, 0]), np.float32([0, 0.4, 0]), np.float32([0, 0, -1]),
                     np.float32([7, 7, 7]))
    room = replace(build.closed_box(), lights=(lamp,), spheres=(at(),))
    up = octahedral.texel_directions(32).reshape(32, 32, 3)[..., 2] > 0.9
    for held, bright in ((frozenset(), False), (frozenset({"lamp"}), True)):
        level = bake_spheres(room, Even(1.0, held), SMALL).probes.maps[0].levels[0].astype(float)
        assert (level[up].min() >= 7.0) == bright and level[up].max() < 9.0


def test_one_inside_a_wall_is_left_out_by_name():
    block = build.cube("block", 0.3)
    room = build.scene([build.cube("room", 2.0, inward=True), block], lights=[build.point_light((0, 0, 1.2))])
    room = replace(room, spheres=(at(name="stuck"), at(1.0, name="free")))
    baked = bake_spheres(room, None, SMALL)
    assert [item.probe.name for item in baked.probes.maps] == ["free"]
    assert baked.notes == ("sphere probe stuck lies inside block and is left out: move it into the open",)
    assert np.isfinite(baked.probes.maps[0].levels[0]).all()
    assert bake_spheres(replace(room, spheres=room.spheres[:1]), None, SMALL).probes is None


def test_what_clipping_hides_is_told_with_names():
    room = replace(build.closed_box(), spheres=(at(clip_start=1.2, clip_end=1.5),))
    notes = bake_spheres(room, None, SMALL).notes
    assert len(notes) == 2 and "Clip Start of 1.2 m" in notes[0] and "Clip End of 1.5 m" in notes[1]
    assert all("sphere probe probe does not see room" in note for note in notes)


@pytest.mark.parametrize(("change", "message"), [
    ({"world_from_local": np.diag([1.0, 0.0, 1.0, 1.0])}, "has a transform or distance that makes no volume of it"),
    ({"influence_distance": 0.0}, "has a transform or distance that makes no volume of it"),
    ({"clip_start": 3.0, "clip_end": 2.0}, "has a Clip Start of 3 m and a Clip End of 2 m")])
def test_what_cannot_be_baked_is_found_before_any_ray(change, message):
    found = [finding for finding in check_scene(replace(build.closed_box(), spheres=(replace(at(), **change),)))
             if "sphere probe" in finding.object]
    assert [finding.message for finding in found] == [message] and found[0].subject[0] == ("probe",)


def test_reflections_fall_back_on_them_by_weight():
    """Of a picture that rays are not followed in: what the probes know of it replaces the field's light, and no more."""
    effect = get("screen_reflections")
    shiny = replace(build.material("shiny", 0.5), metallic=Channel.of(1.0), roughness=Channel.of(0.2))
    room, field = build.scene([build.plane("floor", 3.0)], [shiny], world=1.0), Even(2.0)
    frame = draw_frame(room, field, view((0.0, -3.2, 1.2), False, 2.2), (12, 9))
    settings = effect.Settings(max_roughness=0.0, rays=1)
    plain = effect.apply(replace(frame, passes={}), field, settings)
    seen = frame.gbuffer.seen
    centre = frame.gbuffer.position[seen][:, :3].mean(axis=0)
    for reach, same in ((1e-3, True), (1e3, False)):
        field.spheres = probes((SphereProbe("all", build.transform(centre), influence_distance=reach, parallax_distance=1e3),
                                constant(5.0)))
        found = effect.apply(replace(frame, passes={}), field, settings)
        assert np.array_equal(found, plain) == same
    # Metal shows what it mirrors alone: five times as much as its albedo of a white one.
    assert np.all(np.isfinite(found)) and found[seen][:, :3].mean() > 2.0 * plain[seen][:, :3].mean()


def test_blocks_are_averaged_by_solid_angle():
    directions = octahedral.texel_directions(64).reshape(1, 64, 64, 3)
    assert averaged(np.maximum(directions, 0.0), 1) == pytest.approx(np.full((1, 1, 1, 3), 0.25), abs=2e-4)
