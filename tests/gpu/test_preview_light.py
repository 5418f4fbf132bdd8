"""The preview's direct light against the transport's: every lamp, its shadows, and the BRDF."""

from dataclasses import replace

import brdf
import lamp_profiles
import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.numerics.sampling import sobol_owen
from rtgi_addon.scene import AreaLight, Camera, Channel, Linking, Material, PointLight, SpotLight, SunLight
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.camera import CameraView

SIZE = 24, 16
DOWN = np.float32([0, 0, -1])
TILTED = np.float32([0.6, 0, -0.8])
COLOR = np.float32([3, 2, 1])
LAMPS = {
    "sun": SunLight("sun", TILTED, COLOR),
    "wide sun": SunLight("sun", TILTED, COLOR, 0.3),
    "point": PointLight("point", np.float32([-0.9, 0.3, 2.2]), COLOR),
    "disk": PointLight("point", np.float32([-0.9, 0.3, 2.2]), COLOR, 0.3),
    "sphere": PointLight("point", np.float32([-0.9, 0.3, 2.2]), COLOR, 0.3, soft_falloff=False),
    "spot": SpotLight("spot", np.float32([-1.2, 0, 2.4]), TILTED, COLOR, 1.4, 0.4),
    "soft spot": SpotLight("spot", np.float32([-1.2, 0, 2.4]), TILTED, COLOR, 1.4, 0.4, radius=0.2),
    "wide spot": SpotLight("spot", np.float32([-1.2, 0, 2.4]), DOWN, COLOR, 2.9, 0.1),
    "stretched spot": SpotLight("spot", np.float32([-0.6, 0, 2.4]), DOWN, COLOR, 1.2, 0.3, world_from_local=np.diag([2.0, 1, 1])),
    "rectangle": AreaLight("area", np.float32([-0.8, 0, 2.2]), np.float32([0.4, 0, 0]), np.float32([0, 0.3, 0]), DOWN, COLOR),
    "ellipse": AreaLight("area", np.float32([-0.8, 0, 2.2]), np.float32([0.5, 0, 0]), np.float32([0.2, 0.3, 0]), DOWN, COLOR,
                         "ELLIPSE"),
    "spread": AreaLight("area", np.float32([-0.8, 0, 2.2]), np.float32([0.3, 0, 0]), np.float32([0, 0.3, 0]), DOWN, COLOR,
                        spread=2.0),
    "beam": AreaLight("area", np.float32([-0.3, 0, 2.2]), np.float32([0.7, 0, 0]), np.float32([0, 0.6, 0]), DOWN, COLOR,
                      spread=0.0),
}
# Lamps with nodes: everything that a profile has, where a shader looks it up another way.
LAMPS |= {
    "gobo": replace(LAMPS["wide spot"], profile=lamp_profiles.by_direction(LAMPS["wide spot"], 1.5)),
    "soft gobo": replace(LAMPS["disk"], profile=lamp_profiles.by_direction(LAMPS["disk"])),
    "painted sphere": replace(LAMPS["sphere"], profile=lamp_profiles.by_direction(LAMPS["sphere"], of_normals=True)),
    "fading point": replace(LAMPS["point"], profile=lamp_profiles.linear()),
    "fading sphere": replace(LAMPS["sphere"], profile=lamp_profiles.linear()),
    "textured ellipse": replace(LAMPS["ellipse"], profile=lamp_profiles.by_place()),
    "textured beam": replace(LAMPS["beam"], profile=lamp_profiles.by_place()),
    "all of it": replace(LAMPS["rectangle"], profile=replace(
        lamp_profiles.by_direction(LAMPS["rectangle"], 0.5 * np.pi), by_place=lamp_profiles.by_place().by_place,
        by_distance=lamp_profiles.linear().by_distance)),
}


def camera(size=SIZE, position=(0.0, -3.4, 2.2), lens=1.6):
    """Looks at the scene from above its front edge."""
    back = np.array([*position]) - [0, 0, 0.3]
    back /= np.linalg.norm(back)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), position
    near, far = 0.1, 50.0
    clip = np.array([[lens * size[1] / size[0], 0, 0, 0], [0, lens, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return Camera("eye", pose, clip, size)


def stage(light, **changes):
    """A floor and a ball of two albedos under one lamp."""
    ball = replace(build.sphere("ball", 0.4, 3, material_index=1))
    scene = build.scene([build.plane("floor", 2.0), ball], [build.material("floor", (0.8, 0.6, 0.4)), build.material("ball", 0.5)],
                        [light])
    placed = replace(scene.instances[1], world_from_local=build.transform((0.1, 0.1, 0.6)))
    return replace(scene, instances=(scene.instances[0], placed), **changes)


@pytest.fixture
def centred(monkeypatch):
    """Every sample at the pixels' centres: pictures are then of points."""
    from rtgi_addon.preview import renderer
    monkeypatch.setattr(renderer, "sample_offset", lambda index: np.zeros(2))


def rendered(scene, frames, view=None, passes=("direct",), **settings):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PreviewSettings
    from rtgi_addon.transport.views.camera import CameraView
    result = PreviewRenderer(scene, None, PreviewSettings(shadow_resolution=512, **settings), passes)
    view = view or camera()
    for _ in range(frames):
        result.frame(CameraView.of(view), view.resolution)
    return result


def seen(context, view=None):
    """Points, normals towards the eye, triangles and eye directions of the pixels' centres, rows from the bottom."""
    from rtgi_addon.evaluate.view import View
    view = view or camera()
    width, height = view.resolution
    x, y = np.meshgrid(np.arange(width) + 0.5, height - 0.5 - np.arange(height))
    origins, directions = View(view, view.resolution).rays(x.ravel(), y.ravel())
    hits = context.tracer.intersect(origins, directions)
    # What a ray misses is looked at by no test; −1 is no triangle that a kernel may read.
    primitive = np.maximum(hits.primitive, 0)
    normals = context.geometry.normals_world[primitive]
    normals = normals * -np.sign(np.sum(normals * directions, axis=1, keepdims=True))
    return context.geometry.points(primitive, hits.u, hits.v), normals, hits, -directions


def expected_radiance(scene, samples):
    """(h, w, 3) Lambertian radiance of the pixels' centres by shadow rays to ``samples`` points of the lamp."""
    context = LightContext(scene, 1)
    points, normals, hits, _ = seen(context)
    found = hits.primitive >= 0
    total = np.zeros((len(points), 3))
    for uv in sobol_owen(samples, 2, 3):
        sample = context.lamps.sample(0, points, np.broadcast_to(uv, (len(points), 2)))
        cosine = np.maximum(np.sum(normals * sample.direction, axis=1), 0)
        blocked = context.tracer.occluded((points + 1e-4 * normals).astype(np.float32), sample.direction, sample.distance * 0.999)
        total += sample.irradiance * (cosine * ~(blocked & scene.lights[0].casts_shadow))[:, None]
    albedo = context.surfaces.albedo(np.maximum(hits.primitive, 0), hits.u, hits.v, np.ones(len(hits.u), np.float32))
    return np.where(found[:, None], albedo / np.pi * total / samples, 0).reshape(*SIZE[::-1], 3)


@pytest.mark.parametrize("name", LAMPS)
def test_direct_light_and_shadows_are_those_of_the_transport(gpu_device, centred, name):
    scene = stage(LAMPS[name])
    hard = name in ("sun", "point", "spot", "wide spot", "stretched spot", "beam", "gobo", "fading point", "textured beam")
    picture = rendered(scene, 4 if hard else 64).image("direct")[..., :3]
    expected = expected_radiance(scene, 1 if hard else 256)
    assert expected.max() > 0.05
    difference = np.abs(picture - expected).mean(axis=-1)
    # A pixel on a hard shadow's edge is on one side of it or on the other.
    off = difference > 0.02 * expected.max()
    assert off.mean() < 0.03
    # Of a painted sphere every frame sees the paint at one point.
    assert difference[~off].mean() < (0.002 if hard else 0.015 if name == "painted sphere" else 0.01) * expected.mean()
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.01)


def test_lamps_without_shadow_shine_through(gpu_device, centred):
    scene = stage(replace(LAMPS["point"], casts_shadow=False))
    picture, expected = rendered(scene, 1).image("direct")[..., :3], expected_radiance(scene, 1)
    assert np.abs(picture - expected).max() < 1e-4 * expected.max()
    assert picture.sum() > 1.01 * expected_radiance(stage(LAMPS["point"]), 1).sum()


SEEN = {  # fields of the floor, of the ball and of the lamp
    "hidden from cameras": ({}, {"visible_camera": False}, {}),
    "hidden from shadow rays": ({}, {"visible_shadow": False}, {}),
    "floor not lit": ({}, {}, {"linking": Linking(receivers=np.array([False, True]))}),
    "shadow of the ball alone left out": ({}, {}, {"linking": Linking(blockers=np.array([True, False]))}),
    "ball alone": ({"visible_shadow": False}, {}, {"linking": Linking(np.array([False, True]), np.array([False, True]))}),
}


@pytest.mark.parametrize("name", SEEN)
def test_ray_visibility_and_linking_are_those_of_the_picture_by_rays(gpu_device, centred, name):
    """Held to the twin that casts rays, where shadows' edges are few pixels."""
    scene, (floor, ball, lamp) = stage(LAMPS["point"]), SEEN[name]
    plain = scene
    scene = replace(scene, instances=(replace(scene.instances[0], **floor), replace(scene.instances[1], **ball)),
                    lights=(replace(scene.lights[0], **lamp),))
    picture = rendered(scene, 4).image("direct")[..., :3]
    exact, other = (draw_frame(shown, None, CameraView.of(camera()), SIZE, threads=1).direct[..., :3] for shown in (scene, plain))
    off = np.abs(picture - exact).mean(axis=-1) > 0.02 * other.max()
    assert off.mean() < 0.03 and np.abs(picture - exact)[~off].mean() < 0.005 * other.mean()
    changed = np.abs(exact - other).mean(axis=-1) > 0.02 * other.max()
    assert changed.sum() > 3 and off[changed].mean() < 0.35, (changed.sum(), off[changed].mean())


def test_a_flat_floor_does_not_shade_itself(gpu_device, centred):
    floor = build.scene([build.plane("floor", 50.0)], [build.material("floor", 0.5)],
                        [SunLight("low", np.float32([0.996, 0.05, -0.07]), COLOR)])
    picture = rendered(floor, 3).image("direct")[..., 0]
    assert np.ptp(picture[:8]) < 1e-4 * picture.max() and picture[:8].min() > 0


def test_coverage_without_a_threshold_lets_its_share_of_light_through(gpu_device, centred):
    lamp = PointLight("lamp", np.float32([0, 0, 3]), COLOR)
    pane = build.plane("pane", 1.0, z=2.0, material_index=1)
    scene = build.scene([build.plane("floor", 0.5), pane], [build.material(), Material("pane", alpha=Channel.of(0.3))], [lamp])
    above = camera((8, 8), (0.0, -0.01, 1.5))
    through = rendered(scene, 48, above).image("direct")[..., 0]
    free = rendered(replace(scene, instances=scene.instances[:1]), 1, above).image("direct")[..., 0]
    lit = free > 0
    assert lit.sum() > 10
    assert (through[lit] / free[lit]).mean() == pytest.approx(0.7, abs=0.03)


@pytest.mark.parametrize(("metallic", "roughness", "specular"), [(0, 0.5, 0.0), (0, 0.3, 0.04), (0, 0.9, 0.08), (1, 0.4, 0.04),
                                                                 (0.5, 0.7, 0.04)])
def test_surfaces_reflect_as_the_formulas_say(gpu_device, centred, metallic, roughness, specular):
    base = np.float32([0.7, 0.5, 0.3])
    material = Material("glossy", Channel(base), base_color=Channel(base), metallic=Channel.of(metallic),
                        roughness=Channel.of(roughness), specular=Channel.of(specular))
    lamp = PointLight("lamp", np.float32([0.3, 1.5, 1.8]), COLOR, casts_shadow=False)
    scene = build.scene([build.plane("floor", 2.0)], [material], [lamp])
    picture = rendered(scene, 1).image("direct")[..., :3].reshape(-1, 3)
    context = LightContext(scene, 1)
    points, normals, hits, eyes = seen(context)
    sample = context.lamps.sample(0, points, np.zeros((len(points), 2), np.float32))
    chosen = np.flatnonzero(hits.primitive >= 0)[::11]
    assert len(chosen) > 8
    for index in chosen:
        expected = brdf.reflectance(base, base, metallic, roughness, specular, normals[index], eyes[index], sample.direction[index])
        expected = expected * sample.irradiance[index] * max(float(normals[index] @ sample.direction[index]), 0)
        assert picture[index] == pytest.approx(expected, rel=0.03)


def test_more_lamps_than_shadow_maps_settle_to_the_same_light(gpu_device, centred):
    rng = np.random.default_rng(4)
    lamps = tuple(PointLight(f"lamp {i}", rng.uniform((-1.5, -1.5, 1.2), (1.5, 1.5, 2.5)).astype(np.float32),
                             rng.random(3).astype(np.float32), casts_shadow=False) for i in range(40))
    scene = stage(lamps[0], lights=lamps)
    every, some = rendered(scene, 1).image("direct"), rendered(scene, 80, shadow_views=8).image("direct")
    assert np.abs(every - some).mean() < 0.03 * every.mean()
