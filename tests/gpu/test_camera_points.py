"""Points that the camera puts into live voxels: the lattice of pixels as the shader takes it, their light, and what receivers get
of things that have moved before a worker has put them into voxels."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.scene import PointLight
from rtgi_addon.scene.lights import NOT_AT_ALL
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.gbuffer import draw_gbuffer

SIZE = 120, 90
SETTINGS = {"resolution": 32, "cones": 6, "light": "voxels"}


@pytest.fixture(scope="module")
def preview(gpu_device):
    from rtgi_addon import preview
    return preview


def camera():
    """From above and before, down into the room."""
    back = np.array([0.0, -0.75, 0.66])
    back /= np.linalg.norm(back)
    right = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), (0.0, -4.5, 4.2)
    near, far, aspect = 0.1, 50.0, SIZE[1] / SIZE[0]
    return CameraView(pose, np.array([[2.4 * aspect, 0, 0, 0], [0, 2.4, 0, 0],
                                      [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]]))


def stage(at=(-0.8, 0.0, 0.3), **changes):
    """A red glowing box on a grey floor under a lamp, seen from above."""
    made = build.scene([build.cube("box", 0.3, material_index=1), build.plane("floor", 1.8)],
                       [build.material("floor", 0.7), build.material("box", (0.8, 0.1, 0.1), 1.5)],
                       [PointLight("lamp", np.float32([0.4, -0.8, 2.6]), np.float32([8, 8, 8]))],
                       volumes=[build.volume(center=(0, 0, 0.6), half_size=1.2)])
    placed = replace(made.instances[0], world_from_local=build.transform(at))
    return replace(made, instances=(placed, made.instances[1]), **changes)


def bake(scene):
    technique = techniques.get("cone_tracing")
    return technique.bake(scene, technique.Settings(**SETTINGS), np.random.default_rng(0), Progress())


@pytest.fixture(autouse=True)
def all_cones(preview, monkeypatch):
    """Receivers have all cones in one frame, not those of their turn."""
    monkeypatch.setattr("rtgi_addon.preview.renderer.FRAME_SAMPLES", None)


def renderer(scene, field, **settings):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    return PreviewRenderer(scene, field, PreviewSettings(shadow_resolution=512, **settings), ("irradiance",))


def points_on_the_floor(around, count=200):
    rng = np.random.default_rng(1)
    points = np.zeros((count, 3), np.float32)
    points[:, :2] = np.asarray(around) + rng.uniform(-0.25, 0.25, (count, 2))
    return points, np.tile(np.float32([0, 0, 1]), (count, 1))


@pytest.fixture
def no_worker(monkeypatch):
    """Nobody puts what moved into voxels."""
    from rtgi_addon.preview.indirect.relighting import RelitLight
    monkeypatch.setattr(RelitLight, "follow", lambda self, scene: True)


def test_the_lattice_covers_its_window():
    from rtgi_addon.preview.camera_points import lattice
    boxes = build.transform((0, 0, 0.4))[:3, 3] + 0.4 * np.array([[(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]])
    for points in (16, 500, 4096, 60000):
        for frame in range(5):
            of = lattice(camera(), boxes, SIZE, points, frame)
            pixels = of.pixels.reshape(-1, 2)
            assert len(pixels) <= points and len(np.unique(pixels, axis=0)) == len(pixels)
            assert (pixels >= of.corner).all() and (pixels < np.add(of.corner, of.extent)).all()
            assert of.share * len(pixels) == pytest.approx(of.extent[0] * of.extent[1])
    places, _ = camera().project(boxes[0])
    low, high = places.min(axis=0) * SIZE, places.max(axis=0) * SIZE
    assert (np.array(of.corner) <= low).all() and (np.add(of.corner, of.extent) >= high).all()
    assert lattice(camera(), boxes + np.array([0, 0, 30.0]), SIZE, 4096, 0) is None
    around = lattice(camera(), 20.0 * boxes, SIZE, 4096, 0)
    assert around.extent == SIZE


def test_the_shader_reads_what_the_lattice_says(preview):
    from rtgi_addon.preview.camera_points import lattice, points_of
    from rtgi_addon.preview.device import dispatch
    from rtgi_addon.preview.programs import CAMERA_POINTS, POINT_TARGETS
    from rtgi_addon.preview.textures import download, empty, upload
    drawn = draw_gbuffer(LightContext(stage()), camera(), SIZE)
    textures = {name: upload(array) for name, array in drawn.items()}
    for frame in range(3):
        of = lattice(camera(), np.array([[[-1.2, -0.5, 0.0], [0.0, 0.5, 0.8]] * 4]), SIZE, 700, frame)
        small = {name: empty(*of.count) for name in POINT_TARGETS}
        dispatch(CAMERA_POINTS, of.count, uniforms={"points": {
            "corner": of.corner, "extent": of.extent, "count": of.count, "shift": of.shift}},
            samplers={f"gbuffer_{name}": textures[name] for name in POINT_TARGETS},
            images={f"point_{name}": small[name] for name in POINT_TARGETS})
        x, y = of.pixels[..., 0], of.pixels[..., 1]
        for name in POINT_TARGETS:
            expected = getattr(drawn, name)[y, x].copy()
            if name == "geometry":
                expected[..., 3] = 0
            assert np.array_equal(download(small[name]), expected)
        dark = np.zeros((*x.shape, 4), np.float32)
        found = points_of({name: getattr(drawn, name)[y, x] for name in POINT_TARGETS}, dark, dark + np.float32(np.pi), camera(),
                          of.share / (SIZE[0] * SIZE[1]))
        seen = drawn.seen[y, x]
        # What is emitted, and the albedo of what arrives.
        assert np.allclose(found.radiance, (drawn.emission + drawn.albedo)[y, x][seen][:, :3], atol=1e-6)
        assert np.array_equal(found.instance, drawn.instance[y, x][seen])


def test_points_are_lit_by_lamps_and_by_what_is_there(preview):
    from rtgi_addon.preview.camera_points import PointLight, lattice, read_points
    scene = stage()
    shown = renderer(scene, bake(scene))
    shown.frame(camera(), SIZE)
    of = lattice(camera(), np.array([[[-1.8, -1.8, -0.1], [1.8, 1.8, 0.1]] * 4]), SIZE, 900, 0)
    found = read_points(of, camera(), SIZE, 0, shown.gbuffer, PointLight(shown._lamps, shown._drawn, shown._indirect))
    floor = found.instance == 1
    lamp, albedo = scene.lights[0], 0.7
    way = np.asarray(lamp.position_world, np.float64) - found.positions
    distance = np.linalg.norm(way, axis=1)
    # A point lamp of radiant intensity I: E = I·cos/r²; sources in the scene say what intensity is.
    context = LightContext(scene)
    from rtgi_addon.transport.paths.sources import Sources
    points, normals = (part[floor].astype(np.float32) for part in (found.positions, found.normals))
    reach = np.zeros(len(points), np.float32)
    direct = Sources(context).irradiance(0, points, normals, normals, reach, np.full((len(points), 2), 0.5, np.float32))
    indirect = shown.field.irradiance(points, normals)
    error = np.abs(found.radiance[floor] - albedo / np.pi * (direct + indirect))
    # But for the edges of shadows, in maps.
    assert np.quantile(error, 0.9) < 0.02 * found.radiance[floor].mean() and (distance > 0).all()
    # Lamps that no bake knows light no voxels.
    dark = replace(scene, lights=(replace(scene.lights[0], bake=NOT_AT_ALL),))
    unlit = renderer(dark, bake(dark))
    unlit.frame(camera(), SIZE)
    found = read_points(of, camera(), SIZE, 0, unlit.gbuffer, PointLight(unlit._lamps, unlit._drawn, unlit._indirect))
    floor = found.instance == 1
    assert found.radiance[floor][:, 1] == pytest.approx(albedo / np.pi * unlit.field.irradiance(
        *(part[floor].astype(np.float32) for part in (found.positions, found.normals)))[:, 1], abs=0.01)


def test_light_follows_what_moves_before_voxels_are_made_anew(preview, no_worker):
    from rtgi_addon.preview.indirect.base import irradiance
    before, after = stage(), stage((0.8, 0.2, 0.3))
    shown = renderer(before, bake(before))
    shown.frame(camera(), SIZE)
    assert shown._indirect.moved is None
    there, here = points_on_the_floor((0.8, -0.5)), points_on_the_floor((-0.8, -0.2))
    # Not a bake's: cones see what glows between box and floor through the voxels at the box's foot.
    expected = [irradiance_at(LightContext(after), *where, 256, seed=3).mean for where in (there, here)]
    stale = [irradiance(shown._indirect, *where) for where in (there, here)]
    shown.update(after)
    assert shown._indirect.moved.unknown.tolist() == [True, False]
    for _ in range(4):
        shown.frame(camera(), SIZE)
    found = [irradiance(shown._indirect, *where) for where in (there, here)]
    for new, old, true in zip(found, stale, expected, strict=True):
        new, old, true = (light.mean(axis=0) for light in (new, old, true))
        assert np.abs(old - true).mean() > 0.5 * true.mean()
        # The side that the camera sees lights what is before it; its shadow stays until voxels are lit anew.
        assert np.abs(new - true).mean() < 0.35 * np.abs(old - true).mean()
    # Where it stood it shines no more.
    assert found[1][:, 0].mean() < 0.5 * stale[1][:, 0].mean()
    # Back where it was everything is as it was.
    shown.update(before)
    assert shown._indirect.moved is None


def test_none_are_put_in_where_none_are_asked_for_or_nothing_is_seen(preview, no_worker):
    from rtgi_addon.preview.indirect.base import irradiance
    before, after = stage(), stage((0.8, 0.2, 0.3))
    shown = renderer(before, bake(before), camera_points=0)
    where = points_on_the_floor((-0.8, -0.2))
    shown.frame(camera(), SIZE)
    stale = irradiance(shown._indirect, *where)
    shown.update(after)
    shown.frame(camera(), SIZE)
    assert np.array_equal(irradiance(shown._indirect, *where), stale)
    # What has left the picture is taken out, and nothing put in.
    shown = renderer(before, bake(before))
    shown.update(stage((0.0, 0.0, 40.0)))
    shown.frame(camera(), SIZE)
    assert irradiance(shown._indirect, *where)[:, 0].mean() < 0.5 * stale[:, 0].mean()


def test_a_worker_has_the_last_word(preview):
    from receivers import waited

    from rtgi_addon.preview.indirect.base import irradiance
    before, after = stage(), stage((0.8, 0.2, 0.3))
    shown = renderer(before, bake(before))
    shown.update(after)
    shown.frame(camera(), SIZE)
    assert waited(shown._indirect) and shown._indirect.moved is None
    shown.frame(camera(), SIZE)
    where = points_on_the_floor((0.8, -0.4))
    expected = bake(after).irradiance(*where)
    assert np.abs(irradiance(shown._indirect, *where) - expected).max() < 1e-3 * expected.max()
    shown.close()
