"""The preview's passes, its averaging, and what it takes in when the scene changes."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.scene import Material, PointLight, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.environment import Environment

LAMP = PointLight("lamp", np.float32([-0.9, 0.3, 2.2]), np.float32([3, 2, 1]))
SIZE = 24, 16


def view(orthographic=False, size=SIZE):
    """From above the front edge."""
    from rtgi_addon.transport.views.camera import CameraView
    back = np.array([0.0, -0.87, 0.5]) / np.linalg.norm([0.87, 0.5])
    right = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), (0, -3.4, 2.2)
    near, far, aspect = 0.1, 50.0, size[1] / size[0]
    clip = np.array([[1.2 * aspect, 0, 0, 0], [0, 1.2, 0, 0], [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
                     [0, 0, -1, 0]])
    if orthographic:
        clip = np.array([[0.5 * aspect, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, -2 / (far - near), -(far + near) / (far - near)],
                         [0, 0, 0, 1]])
    return CameraView(pose, clip)


def stage(world=0.3, **changes):
    """A floor and a glowing ball under a lamp."""
    ball = build.sphere("ball", 0.4, 2, material_index=1)
    scene = build.scene([build.plane("floor", 2.0), ball], [build.material("floor", (0.8, 0.6, 0.4)),
                                                            build.material("ball", 0.5, 0.25)], [LAMP], world)
    placed = replace(scene.instances[1], world_from_local=build.transform((0.1, 0.1, 0.6)))
    return replace(scene, instances=(scene.instances[0], placed), **changes)


def renderer(scene, passes=None, **settings):
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.preview.settings import PASSES, PreviewSettings
    return PreviewRenderer(scene, None, PreviewSettings(shadow_resolution=128, **settings), passes or PASSES)


def directions(seen, size=SIZE):
    """World directions (h·w, 3) through the pixels' centres, rows from the bottom."""
    base, across, up = seen.rays(size)
    x, y = np.meshgrid((np.arange(size[0]) + 0.5) / size[0], (np.arange(size[1]) + 0.5) / size[1])
    return (base + x[..., None] * across + y[..., None] * up).reshape(-1, 3)


def painted_world(seed=3):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return World(rng.random((7, 12, 3)).astype(np.float32), turn * np.sign(np.linalg.det(turn)))


@pytest.mark.parametrize("orthographic", [False, True])
def test_passes_fit_together(gpu_device, orthographic):
    scene, seen = stage(), view(orthographic)
    result = renderer(scene)
    result.frame(seen, SIZE)
    image = {name: result.image(name) for name in result.textures}
    surface = image["object"][..., 0] > 0
    assert 0.1 < surface.mean() < 0.95
    assert np.all(np.isin(image["object"][..., 0], [0, 1, 2]))
    emission = np.where(image["object"][..., :1] == 2, 0.25, 0.0)
    total = image["direct"] + image["indirect"]
    assert np.allclose(image["combined"][surface][:, :3], (total[..., :3] + emission)[surface], atol=1e-6)
    assert np.allclose(image["indirect"][..., :3], image["albedo"][..., :3] * image["irradiance"][..., :3] / np.pi, atol=1e-6)
    # The world alone, from everywhere: what is shown where there is no bake.
    assert np.allclose(image["irradiance"][surface][:, :3], 0.3 * np.pi, rtol=1e-4)
    assert np.allclose(image["combined"][~surface], [0.3, 0.3, 0.3, 1.0])
    assert np.all(image["depth"][~surface][:, 0] == 1e10) and not image["normal"][~surface].any()
    assert np.allclose(np.linalg.norm(image["normal"][surface][:, :3], axis=1), 1, atol=1e-5)


@pytest.mark.parametrize("orthographic", [False, True])
def test_depth_and_normals_are_those_of_rays(gpu_device, orthographic):
    scene, seen = stage(), view(orthographic)
    result = renderer(scene)
    result.frame(seen, SIZE)
    context = LightContext(scene, 1)
    rays = directions(seen).astype(np.float32)
    pose = seen.world_from_camera
    origins = np.broadcast_to(pose[:3, 3], rays.shape).astype(np.float32)
    if orthographic:
        x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2 - 1)
        local = np.stack([x / seen.clip_from_camera[0, 0], y / seen.clip_from_camera[1, 1], 0 * x], -1).reshape(-1, 3)
        origins = (local @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
    hits = context.tracer.intersect(origins, rays)
    same = (hits.primitive >= 0) == (result.image("object")[..., 0].ravel() > 0)
    assert same.mean() > 0.98
    both = same & (hits.primitive >= 0)
    points = context.geometry.points(np.maximum(hits.primitive, 0), hits.u, hits.v)
    depth = (points - pose[:3, 3]) @ -pose[:3, 2]
    off = np.abs(result.image("depth")[..., 0].ravel() - depth)[both] > 1e-3
    assert off.mean() < 0.02


@pytest.mark.parametrize("orthographic", [False, True])
def test_the_background_is_the_world(gpu_device, orthographic):
    scene, seen = stage(world=0.0), view(orthographic)
    scene = replace(scene, world=painted_world())
    result = renderer(scene, ("combined", "object"))
    result.frame(seen, SIZE)
    nothing = result.image("object")[..., 0].ravel() == 0
    expected = Environment(scene.world).radiance(directions(seen))
    assert np.allclose(result.image("combined").reshape(-1, 4)[nothing, :3], expected[nothing], atol=2e-3)


def test_a_transparent_film_leaves_the_world_out_and_its_light_in(gpu_device):
    result, opaque = renderer(stage(), film_transparent=True), renderer(stage())
    for item in (result, opaque):
        for _ in range(8):
            item.frame(view(), SIZE)
    picture, alpha = result.image("combined")[..., :3], result.image("combined")[..., 3]
    assert alpha.min() == 0 and alpha.max() == 1
    assert np.any((alpha > 0.05) & (alpha < 0.95))
    # Over the world it is the opaque picture: colours are premultiplied.
    assert np.allclose(picture + 0.3 * (1 - alpha)[..., None], opaque.image("combined")[..., :3], atol=1e-5)


def test_edges_settle_to_coverage(gpu_device):
    result = renderer(stage(world=0.0, lights=(), materials=(Material("floor"), build.material("ball", 0.0, 1.0))), ("combined",))
    # Large pixels of the same view hold the mean of the small ones, but for the filter's reach.
    for _ in range(64):
        result.frame(view(), SIZE)
    coarse = result.image("combined")[..., 0]
    assert result.samples == 64
    fine = renderer(result.scene, ("combined",))
    fine.frame(view(), (SIZE[0] * 8, SIZE[1] * 8))
    assert 0.01 < np.mean((coarse > 0.1) & (coarse < 0.9))
    assert coarse.mean() == pytest.approx(fine.image("combined")[..., 0].mean(), rel=0.02)


def test_lamps_that_the_bake_holds_are_not_added_again(gpu_device):
    from rtgi_addon import techniques
    from rtgi_addon.preview.renderer import PreviewRenderer
    scene = stage(0.0, volumes=(build.volume("room", half_size=(1.5, 1.5, 1.0), center=(0.0, 0.0, 1.0)),))
    method = techniques.get("probes")
    light = {}
    for direct in (False, True):
        field = method.bake(scene, method.Settings(rays=64, direct=direct), np.random.default_rng(1), Progress())
        result = PreviewRenderer(scene, field, passes=("direct", "irradiance"))
        result.frame(view(), SIZE)
        light[direct] = {name: result.image(name)[..., :3] for name in ("direct", "irradiance")}
        result.close()
    assert light[False]["direct"].max() > 0.1 and not light[True]["direct"].any()
    assert light[True]["irradiance"].mean() > 1.5 * light[False]["irradiance"].mean()


def test_of_several_lamps_those_are_added_that_the_bake_lacks(gpu_device):
    """One is in it as a whole, one by its bounces, and one that no bake knows shines all the same."""
    from rtgi_addon import techniques
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.scene.lights import ALL_LIGHT, NOT_AT_ALL
    scene = stage(0.0, volumes=(build.volume("room", half_size=(1.5, 1.5, 1.0), center=(0.0, 0.0, 1.0)),))
    roles = {"whole": ALL_LIGHT, "bounces": "BOUNCES", "none": NOT_AT_ALL}
    lamps = tuple(replace(build.point_light((x, 0.3, 2.0), 1.0, name), bake=role)
                  for x, (name, role) in zip((-0.8, 0.0, 0.8), roles.items(), strict=True))
    scene = replace(scene, lights=lamps)
    method = techniques.get("probes")
    field = method.bake(scene, method.Settings(rays=64), np.random.default_rng(1), Progress())
    pictures = []
    for shown, light in ((scene, field), (replace(scene, lights=lamps[1:]), None)):
        result = PreviewRenderer(shown, light, passes=("direct",))
        result.frame(view(), SIZE)
        pictures.append(result.image("direct")[..., :3])
        result.close()
    assert pictures[1].max() > 0.1
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-3 * pictures[1].max())


def test_another_view_size_or_scale_begins_anew(gpu_device):
    result = renderer(stage(), ("combined",), resolution_scale=0.5)
    result.frame(view(), SIZE)
    result.frame(view(), SIZE)
    assert result.samples == 2 and result.size == (12, 8)
    result.frame(view(orthographic=True), SIZE)
    assert result.samples == 1
    result.frame(view(orthographic=True), (20, 10))
    assert result.samples == 1 and result.size == (10, 5) and result.image("combined").shape == (5, 10, 4)
    result.reset()
    assert result.samples == 0


def moved(scene):
    ball = replace(scene.instances[1], world_from_local=build.transform((-0.8, 0.3, 1.0)))
    return replace(scene, instances=(scene.instances[0], ball))


CHANGES = {
    "nothing": lambda scene: replace(scene),
    "a moved object": moved,
    "a mirrored object": lambda scene: replace(scene, instances=(scene.instances[0], replace(
        scene.instances[1], world_from_local=build.transform((0.1, 0.1, 0.7), (-1, 1, 1))))),
    "a moved lamp": lambda scene: replace(scene, lights=(replace(LAMP, position_world=np.float32([1, -0.5, 1.5])),)),
    "no lamp": lambda scene: replace(scene, lights=()),
    "two lamps": lambda scene: replace(scene, lights=(LAMP, replace(LAMP, position_world=np.float32([1, -0.5, 1.5])))),
    "another world": lambda scene: replace(scene, world=painted_world()),
    "another material": lambda scene: replace(scene, materials=(scene.materials[0], build.material("ball", 0.9, 0.0))),
    "another mesh": lambda scene: replace(scene, meshes=(scene.meshes[0], build.cube("cube", 0.3, material_index=1))),
    "an object more": lambda scene: replace(scene, instances=(*scene.instances, replace(
        scene.instances[1], world_from_local=build.transform((-1, 0, 1))))),
    "an object less": lambda scene: replace(scene, instances=scene.instances[:1]),
    "an empty scene": lambda scene: replace(scene, instances=()),
}


@pytest.mark.parametrize("change", CHANGES)
def test_an_update_shows_what_a_new_renderer_shows(gpu_device, change):
    before, after = stage(), CHANGES[change](stage())
    result, fresh = renderer(before), renderer(after)
    result.frame(view(), SIZE)
    first = result.image("combined")
    result.update(after)
    assert result.samples == 0
    result.frame(view(), SIZE)
    fresh.frame(view(), SIZE)
    for name in result.textures:
        assert np.allclose(result.image(name), fresh.image(name), atol=1e-6), name
    assert (change == "nothing") == bool(np.allclose(first, result.image("combined"), atol=1e-6))
    result.update(stage())
    result.frame(view(), SIZE)
    assert np.allclose(result.image("combined"), first, atol=1e-6)
