"""The compiled kernels against the numpy code that they stand beside: the same integers, and floats apart by rounding alone.

Tolerances: 1e-6 of the greatest value where the arithmetic is the same; 2e-5 where sines, logarithms or sums are in it; 1e-4 of a
probe's norm for what a whole bake gives: usually some 1e-7, more where a hit on the edge of two texels falls to the other.
"""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import kernels
from rtgi_addon.effects.frame import GATHERED
from rtgi_addon.effects.kept_light import KeptLight
from rtgi_addon.effects.ray_traced.diffuse import _means
from rtgi_addon.effects.ray_traced.smoothing import smoothed
from rtgi_addon.numerics import octahedral, sampling, sh
from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight, Channel, Material, PointLight, SpotLight, SunLight, Texture
from rtgi_addon.techniques import get
from rtgi_addon.techniques.lattice.reconstruction import dering
from rtgi_addon.techniques.vpl.gather import gather
from rtgi_addon.techniques.vpl.virtual_lights import VirtualLights
from rtgi_addon.transport.cache.look import CachedScene
from rtgi_addon.transport.cache.texels import Focus, TexelLayout
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.lamps import LampTable
from rtgi_addon.transport.paths.numbers import PathNumbers
from rtgi_addon.transport.rays import embree, embree_scene
from rtgi_addon.transport.surfaces import ggx
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.vectors import dot, normalized

pytestmark = pytest.mark.skipif(not kernels.is_available(), reason=f"no compiled kernels: {kernels.missing()}")
traces = pytest.mark.skipif(embree_scene.missing() is not None or not embree.is_available(), reason="no Embree for the kernels")
COUNT = 4000


def both(work):
    """What ``work`` gives by the kernels, and by numpy."""
    by_kernel = work()
    with kernels.switched_off():
        return by_kernel, work()


def assert_close(work, tolerance):
    """The parts of what ``work`` gives differ by no more than ``tolerance`` of their greatest value."""
    ours, numpys = both(work)
    for a, b in zip(ours, numpys, strict=True):
        a, b = np.nan_to_num(a, posinf=1e9), np.nan_to_num(b, posinf=1e9)
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance * np.abs(b).max(initial=1e-30))


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def hits_on(scene, rng, count=COUNT):
    """Random triangles of a scene with barycentrics on them."""
    geometry = flatten(scene)
    a, b = rng.random((2, count)).astype(np.float32)
    over = a + b > 1
    u, v = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    return geometry, rng.integers(0, geometry.count, count).astype(np.int32), u, v


def test_sobol_numbers_are_the_same_bits(rng):
    index = rng.integers(0, 1 << 20, (50, 1))
    seeds = rng.integers(0, 1 << 32, 40).astype(np.uint32)
    for first, last in ((0, 2), (2, 5), (0, sampling.SOBOL_DIMENSIONS)):
        ours, numpys = both(lambda: sampling.sobol_owen_at(index, last, seeds, first=first))  # noqa: B023
        assert ours.shape == (50, 40, last - first)
        np.testing.assert_array_equal(ours, numpys)


def test_cells_and_bases_of_directions(rng):
    directions = rng.normal(size=(COUNT, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    for resolution in (4, 8, 13):
        ours, numpys = both(lambda: octahedral.texel_index(directions, resolution))  # noqa: B023
        np.testing.assert_array_equal(ours, numpys)
    for order in range(4):
        assert_close(lambda: [sh.evaluate_rows(directions, order)], 1e-6)  # noqa: B023


@pytest.mark.parametrize("lamp", [
    SunLight("a", np.float32([0.3, 0.1, -0.9]), np.float32([3, 2, 1])),
    SunLight("b", np.float32([0, 0.6, -0.8]), np.float32([3, 2, 1]), 0.2),
    PointLight("c", np.float32([0.2, 0.1, 0.4]), np.float32([1, 2, 3])),
    PointLight("d", np.float32([0.2, 0.1, 0.4]), np.float32([1, 2, 3]), 0.5, True),
    PointLight("e", np.float32([0.2, 0.1, 0.4]), np.float32([1, 2, 3]), 0.5, False),
    SpotLight("f", np.float32([0, 0, 1]), np.float32([0, 0.6, -0.8]), np.ones(3, np.float32), 1.2, 0.4),
    SpotLight("g", np.float32([0, 0, 1]), np.float32([0, 0.6, -0.8]), np.ones(3, np.float32), 1.2, 0.0, 0.7, False),
    *(AreaLight("h", np.float32([0, 0, 1]), np.float32([0.5, 0, 0]), np.float32(half_v), np.float32([0, 0, -1]),
                np.float32([1, 2, 3]), shape=shape, spread=spread)
      for shape in ("RECTANGLE", "ELLIPSE") for half_v in ([0, 0.25, 0], [0.2, 0.25, 0]) for spread in (np.pi, 1.0, 0.0)),
], ids=lambda lamp: f"{type(lamp).__name__}-{lamp.name}")
def test_lamps_are_sampled_alike(lamp, rng):
    points = (rng.random((COUNT, 3)) * 3 - 1.5).astype(np.float32)
    uv = rng.random((COUNT, 2)).astype(np.float32)

    def work():
        sample = LampTable((lamp,)).sample(0, points, uv)
        return sample.direction, sample.irradiance, sample.direction * np.minimum(sample.distance, 1e6)[:, None]

    ours, numpys = both(work)
    # A lamp's irradiance has no greatest value: what is near it is compared relatively.
    np.testing.assert_allclose(ours[0], numpys[0], atol=2e-5)
    np.testing.assert_allclose(ours[1], numpys[1], rtol=5e-4, atol=2e-5 * np.median(numpys[1].max(axis=1)) + 1e-9)
    np.testing.assert_allclose(ours[2], numpys[2], rtol=2e-4, atol=2e-5)


def test_a_lamp_of_each_point(rng):
    lamps = tuple(rooms.many_lamps().lights)
    points, uv = rng.random((COUNT, 3)).astype(np.float32), rng.random((COUNT, 2)).astype(np.float32)
    index = rng.integers(0, len(lamps), COUNT)
    assert_close(lambda: [LampTable(lamps).sample(index, points, uv).direction], 2e-5)


@pytest.mark.parametrize("extension", ["REPEAT", "MIRROR", "CLIP", "EXTEND"])
@pytest.mark.parametrize("dtype", [np.uint8, np.float16, np.float32])
def test_textures_are_read_alike(extension, dtype, rng):
    pixels = rng.random((7, 12, 4)) * (255 if dtype == np.uint8 else 1.2)
    channels = []
    for number, (interpolation, srgb, component) in enumerate((("Linear", True, "rgb"), ("Linear", False, "a"),
                                                               ("Closest", False, "g"), ("Linear", True, "r"))):
        texture = Texture(f"t{number}", pixels.astype(dtype)[..., :3 if number == 2 else 4], srgb=srgb, interpolation=interpolation,
                          extension=extension)
        transform = None if number % 2 else np.float32([[1.5, 0.2, -0.3], [0.1, -2.0, 0.7]])
        channels.append(Channel(np.float32([0.9, 0.8, 0.7]), texture=texture, texture_channel=component, uv_transform=transform))
    scene = rooms.textured_room()
    meshes = tuple(replace(mesh, triangle_material=(np.arange(len(mesh.triangles)) % len(channels)).astype(np.int32))
                   for mesh in scene.meshes)
    scene = replace(scene, meshes=meshes, materials=tuple(Material(f"m{i}", albedo=channel) for i, channel in enumerate(channels)))
    geometry, primitive, u, v = hits_on(scene, rng)
    surfaces = Surfaces(scene, geometry)
    assert_close(lambda: [surfaces.albedo(primitive, u, v, np.ones(COUNT, np.float32))], 1e-5)


def test_normals_points_and_slots(rng):
    mesh = build.sphere(subdivisions=2)
    corners = mesh.vertices_local[mesh.triangles]
    scene = build.scene([replace(mesh, corner_normals_local=corners / np.linalg.norm(corners, axis=-1, keepdims=True)),
                         build.plane(half_size=30.0, z=-1.0)])
    geometry, primitive, u, v = hits_on(scene, rng)
    surfaces = Surfaces(scene, geometry)
    assert_close(lambda: [geometry.points(primitive, u, v), surfaces.shading_normal(primitive, u, v)], 1e-6)
    layout = TexelLayout(geometry, Focus(np.zeros(3), 0.5, 0.07))
    front = rng.random(COUNT) < 0.5
    ours, numpys = both(lambda: layout.slots(primitive, u, v, front))
    # The grid's cells grow with the distance by an inverse hyperbolic sine: a hit on an edge may fall to either side.
    assert np.mean(ours != numpys) < 1e-3
    assert np.array_equal(ours & 1, front)


@traces
def test_rays_hit_the_same_to_the_bit(rng):
    geometry = flatten(rooms.many_lamps())
    origins, directions = rng.normal(size=(2, COUNT, 3)).astype(np.float32)
    ours, theirs = embree_scene.KernelTracer(geometry), embree.EmbreeTracer(geometry)
    a, b = ours.intersect(origins, directions), theirs.intersect(origins, directions)
    for name in ("primitive", "u", "v", "t"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    limits = rng.random(COUNT).astype(np.float32)
    np.testing.assert_array_equal(ours.occluded(origins, directions, limits), theirs.occluded(origins, directions, limits))


SCENES = {
    "a box and a lamp": build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)),
    "emissive": rooms.panel_room(0.6),
    "textures": rooms.textured_room(),
    "cut-outs": rooms.screen_room(),
    "many lamps": rooms.many_lamps(),
    "a patch of sun": rooms.sun_patch_room(),
    "sky with a sun": rooms.courtyard(),
    "open": build.open_plane(),
}


def coefficients(scene, threads=1, **settings):
    technique = get("probes")
    chosen = technique.Settings(**({"rays": 128, "cache_rays": 8, "texel_size": 0.3} | settings))
    field = technique.bake(scene, chosen, np.random.default_rng(3), Progress(), threads=threads)
    return np.concatenate([grid.sh.reshape(-1, *grid.sh.shape[3:]) for grid in field.grids()]), field


@traces
@pytest.mark.parametrize("name", SCENES)
def test_a_bake_is_the_same(name):
    (ours, field), (numpys, other) = both(lambda: coefficients(SCENES[name]))
    assert field.stats["texels"] == other.stats["texels"] and field.stats["probe_rays"] == other.stats["probe_rays"]
    norm = np.maximum(np.linalg.norm(numpys, axis=(1, 2)), 1e-3 * np.linalg.norm(numpys, axis=(1, 2)).max())
    assert (np.linalg.norm(ours - numpys, axis=(1, 2)) / norm).max() < 1e-4
    for a, b in zip(field.grids(), other.grids(), strict=True):
        np.testing.assert_allclose(a.visibility, b.visibility, rtol=1e-4, atol=1e-5 * b.visibility.max())


@traces
@pytest.mark.parametrize("name", ["a box and a lamp", "textures", "sky with a sun", "open"])
def test_a_relit_bake_is_the_same(name):
    scene = SCENES[name]
    other = replace(scene, lights=tuple(replace(lamp, **{strength: np.float32([2.0, 0.5, 1.0]) * getattr(lamp, strength)
                                                         for strength in ("intensity", "irradiance") if hasattr(lamp, strength)})
                                        for lamp in scene.lights))
    _, field = coefficients(scene)

    def relit():
        return [np.concatenate([grid.sh.reshape(-1, *grid.sh.shape[3:]) for grid in field.relight(other).grids()])]

    assert_close(relit, 1e-4)


@traces
def test_threads_change_no_byte():
    one, three = (coefficients(SCENES["a patch of sun"], threads)[0] for threads in (1, 3))
    assert one.tobytes() == three.tobytes()


@traces
@pytest.mark.parametrize("clamp", [None, 3.0])
@pytest.mark.parametrize("shadows", [True, False])
def test_virtual_lights_give_the_same(clamp, shadows, rng):
    context = LightContext(rooms.many_lamps())
    geometry, primitive, u, v = hits_on(context.scene, rng, 300)
    points, normals = geometry.points(primitive, u, v), -np.sign(geometry.points(primitive, u, v)) / np.sqrt(np.float32(3))
    positions = (rng.random((70, 3)) - 0.5).astype(np.float32)
    facing = rng.normal(size=(70, 3)).astype(np.float32)
    lights = VirtualLights.of(positions, facing / np.linalg.norm(facing, axis=1, keepdims=True),
                              rng.random((70, 3)).astype(np.float32))
    assert_close(lambda: [gather(context, lights, points, normals, clamp=clamp, shadows=shadows)], 2e-5)


@pytest.mark.parametrize("order", [1, 2])
def test_probes_are_deringed_alike(order, rng):
    probes = rng.normal(size=(150, (order + 1) ** 2, 3)).astype(np.float32)
    # Some ring in all channels, some in none, some have no light in one or in all.
    probes[:, 0] = np.abs(probes[:, 0]) + np.linspace(0.0, 4.0, 150)[:, None]
    probes[3, 0, 1], probes[4] = -1.0, 0.0
    ours, numpys = both(lambda: dering(probes))
    assert np.array_equal(np.any(ours != probes, axis=(1, 2)), np.any(numpys != probes, axis=(1, 2)))
    np.testing.assert_allclose(ours, numpys, atol=2e-5 * np.abs(probes).max())


def test_surfaces_reflect_alike(rng):
    def numbers(*shape):
        return np.float32(rng.random(shape))

    inputs = [numbers(COUNT, 3), numbers(COUNT, 3), *(numbers(COUNT) for _ in range(4))]
    for value in (0.0, 1.0):
        for array in inputs:
            array[np.flatnonzero(rng.random(COUNT) < 0.1)] = value
    assert_close(lambda: [getattr(ggx.surface_look(*inputs), item.name) for item in fields(ggx.SurfaceLook)], 2e-5)
    look = ggx.surface_look(*inputs)
    normals, towards = (normalized(np.float32(rng.normal(size=(COUNT, 3)))) for _ in range(2))
    towards = towards * np.copysign(np.float32(1.0), dot(normals, towards))[:, None]
    towards[:50], towards[50:60] = normals[:50], -normals[50:60]
    numbers = numbers(COUNT, 2)
    assert_close(lambda: ggx.sample_reflection(look, normals, towards, numbers), 2e-5)


def test_layers_reflect_alike_in_all():
    def table():
        ggx.energy_table.cache_clear()
        return [ggx.energy_table()]

    assert_close(table, 1e-6)


@traces
@pytest.mark.parametrize("rays", [1, 3, 8])
def test_rays_of_pixels_are_the_same(rays, rng):
    context = LightContext(replace(rooms.panel_room(0.6), cameras=()))
    scene = CachedScene.about(context, np.zeros(3), 1.0)
    points, normals = np.float32(rng.uniform(-0.9, 0.9, (101, 3))), normalized(np.float32(rng.normal(size=(101, 3))))
    faces = normalized(normals + np.float32(0.5) * np.float32(rng.normal(size=(101, 3))))
    numbers = PathNumbers(np.repeat(rng.integers(0, 2**32, 101, np.uint32), rays), np.tile(np.arange(rays), 101))
    radiance = np.float32(rng.random((101 * rays, 3)))

    def work():
        looks = scene.look_about(points, normals, faces, numbers, rays)
        return looks, _means(looks, radiance, faces, rays)

    (ours, mean), (numpys, numpys_mean) = both(work)
    np.testing.assert_array_equal(ours.rows, numpys.rows)
    for name in ("primitive", "slots"):
        # Rounding may move a hit over the edge of a triangle or a texel.
        assert np.mean(getattr(ours.hits, name) == getattr(numpys.hits, name)) > 0.99
    for name in ("origins", "directions", "t", "density"):
        a, b = getattr(ours, name), getattr(numpys, name)
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5, err_msg=name)
    assert np.mean(np.abs(ours.cosine - numpys.cosine) < 1e-5) > 0.99
    np.testing.assert_allclose(mean, numpys_mean, rtol=1e-4)


@pytest.mark.parametrize("spacing", [1, 3])
def test_pixels_share_light_alike(spacing, rng):
    rows, columns = np.indices((40, 60)).astype(np.float32)
    normals = normalized(np.stack([np.sin(columns / 9), np.cos(rows / 7), 1 + 0 * rows], axis=-1).reshape(-1, 3)).reshape(40, 60, 3)
    seen = rng.random((40, 60)) < 0.95
    gbuffer = SimpleNamespace(position=np.stack([columns, rows, np.sin(columns / 5), 0 * rows], axis=-1),
                              normal=normals * seen[..., None], seen=seen)
    frame = SimpleNamespace(gbuffer=gbuffer, footprint=np.full((40, 60), np.float32(0.9)), samples=None, index=3, bare=False,
                            irradiance=np.ones((40, 60, 4), np.float32))
    light, known = np.float32(rng.random((40, 60, 4))), rng.random((40, 60)) < 1.0 / spacing**2
    assert_close(lambda: [smoothed(frame, light, known, spacing)], 1e-4)


def test_kept_light_is_read_alike(rng):
    kept, numbers = KeptLight(), rng.random((3, 500, 4)).astype(np.float32)
    normals = normalized(np.float32([0, 0, 2]) + rng.random((500, 3)).astype(np.float32))
    for part in numbers:
        gbuffer = SimpleNamespace(position=part, normal=normals, albedo=part)
        kept.add(SimpleNamespace(kept={GATHERED: part}, gbuffer=gbuffer), 2.0)
    pixel, width = rng.integers(0, 500, COUNT), np.full(COUNT, 0.5, np.float32)
    points = numbers[0, pixel, :3]
    assert_close(lambda: kept._mean(range(3), pixel, points, normals[pixel], width)[:1], 2e-5)


def test_arrays_of_another_kind_are_refused():
    with pytest.raises(TypeError, match="points takes dense arrays of int32"):
        kernels.call("points", 1, np.zeros((1, 3, 3), np.float32), 1, np.zeros(1, np.int64), *np.zeros((2, 1), np.float32),
                     np.zeros((1, 3), np.float32))
    geometry = flatten(build.closed_box(0.5))
    with pytest.raises(ValueError, match="2 hits are expected"):
        geometry.points(np.zeros(2, np.int32), np.zeros(3, np.float32), np.zeros(2, np.float32))
    with pytest.raises(IndexError, match="lamp 1 of 1"):
        LampTable((SunLight("sun", np.float32([0, 0, -1]), np.ones(3, np.float32)),)).records.sample(
            1, np.zeros((1, 3), np.float32), np.zeros((1, 2), np.float32))
