"""The G-buffer against rays through the texels' centres and the materials at their hits."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from room_scenes import quad

from rtgi_addon.scene import Channel, Instance, Material, PointLight, SpotLight, Texture
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.shadow_views import views_of

# Roundings at grazing angles, relative to values of the order of 1.
TOLERANCE = 1e-4


@pytest.fixture
def scene():
    """A textured floor with every input at work, behind a culled pane, lit from where the camera stands."""
    rng = np.random.default_rng(0)
    image = Texture("noise", rng.random((8, 8, 4)).astype(np.float32))
    floor = quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    floor = replace(floor, attributes={"paint": rng.random((2, 3, 4)).astype(np.float32)})
    tiles = Material("tiles", albedo=Channel(texture=image), emission=Channel(np.float32([5, 4, 3]), texture=image),
                     base_color=Channel(attribute="paint"), metallic=Channel(texture=image, texture_channel="b"),
                     roughness=Channel(np.float32([0.5] * 3), attribute="paint", offset=np.float32([0.1] * 3)))
    pane = quad("pane", (-1, -1, 1), (0, 2, 0), (2, 0, 0), 1)
    return build.scene([floor, pane], [tiles, Material("pane", backface_culling=True)],
                       [SpotLight("eye", np.float32([0.1, 0.2, 3.0]), np.float32([0, 0, -1]), np.float32([1, 1, 1]), 1.0)])


def drawn(scene, view, resolution):
    from rtgi_addon.preview.gbuffer import GBuffer, gbuffer_surfaces
    from rtgi_addon.preview.textures import download
    from rtgi_addon.transport.views.camera import View
    context = LightContext(scene, 1)
    target = GBuffer(resolution, resolution)
    target.draw(gbuffer_surfaces(scene), View(view.clip_from_world, view.world_from_view, view.far, False))
    return context, {name: download(texture) for name, texture in target.textures.items()}


def test_every_input_of_a_material_arrives(gpu_device, scene):
    from rtgi_addon.transport.views.gbuffer import decode_primitive
    view = views_of(LightContext(scene, 1), 0, 64)[0]
    _, images = drawn(scene, view, 64)
    # The pane is culled: what is seen is the floor.
    primitive = decode_primitive(images["position"], images["normal"])
    floor = scene.meshes[0].triangles
    assert primitive.min() >= 0 and primitive.max() < len(floor)
    alone = LightContext(replace(scene, instances=scene.instances[:1]), 1)
    hits = alone.tracer.intersect(*view.rays())
    same = primitive.ravel() == hits.primitive
    assert same.mean() > 0.98
    material = scene.materials[0]
    for target, columns, channel in (("albedo", slice(0, 3), "albedo"), ("base_color", slice(0, 3), "base_color"),
                                     ("emission", slice(0, 3), "emission"), ("base_color", slice(3, 4), "metallic"),
                                     ("emission", slice(3, 4), "roughness")):
        expected = alone.surfaces.channel(getattr(material, channel), hits.primitive, hits.u, hits.v)[same]
        if channel == "albedo":
            expected = np.minimum(expected, 0.998)
        found = images[target].reshape(-1, 4)[same][:, columns]
        assert np.abs(found - expected[:, :found.shape[1]]).max() < TOLERANCE * max(expected.max(), 1), channel
    assert np.allclose(images["normal"][..., :3], [0, 0, 1])
    assert not images["albedo"][..., 3].any()


@pytest.mark.parametrize("broken", [[[np.nan] * 3, [0.6, 0, 0.8], [0.6, 0, 0.8]], [[0.6, 0, 0.8], [np.inf, 0, 0], [0.6, 0, 0.8]],
                                    np.zeros((3, 3))], ids=["no number", "infinite", "zero"])
def test_a_triangle_with_a_broken_normal_has_its_faces_own(gpu_device, scene, broken):
    """On both halves: one corner spoils every point of its triangle, and of no other."""
    normals = np.tile(np.float32([0.6, 0.0, 0.8]), (2, 3, 1))
    normals[0] = broken
    floor = replace(scene.meshes[0], corner_normals_local=normals)
    scene = replace(scene, meshes=(floor, scene.meshes[1]), instances=scene.instances[:1])
    context, images = drawn(scene, views_of(LightContext(scene, 1), 0, 16)[0], 16)
    third = np.float32([1 / 3, 1 / 3])
    smooth = context.surfaces.shading_normal(np.array([0, 1]), third, third)
    assert np.allclose(smooth, [[0, 0, 1], [0.6, 0, 0.8]], atol=1e-6)
    found = np.unique(np.round(images["normal"][..., :3].reshape(-1, 3), 3), axis=0)
    assert np.allclose(found, [[0, 0, 1], [0.6, 0, 0.8]], atol=1e-3)


@pytest.mark.parametrize(("mirrored", "flipped"), [(False, False), (False, True), (True, False), (True, True)])
def test_backs_are_left_out_of_mirrored_instances_too(gpu_device, scene, mirrored, flipped):
    from rtgi_addon.transport.views.gbuffer import decode_primitive
    edges = ((2, 0, 0), (0, 2, 0)) if flipped else ((0, 2, 0), (2, 0, 0))
    pane = quad("pane", (-1, -1, 1), *edges, 1)
    placed = (scene.instances[0], Instance("pane", 1, build.transform(scale=(-1 if mirrored else 1, 1, 1))))
    scene = replace(scene, meshes=(scene.meshes[0], pane), instances=placed)
    context, images = drawn(scene, views_of(LightContext(scene, 1), 0, 16)[0], 16)
    seen = np.any(decode_primitive(images["position"], images["normal"]) >= 2)
    # What the transport calls the front is what is drawn.
    assert seen == (context.geometry.normals_world[2, 2] > 0)


def test_nothing_is_seen_where_nothing_is(gpu_device, scene):
    empty = replace(scene, lights=(PointLight("eye", np.float32([0, 0, 3]), np.float32([1, 1, 1])),))
    up = views_of(LightContext(empty, 1), 0, 16)[4]
    _, images = drawn(empty, up, 16)
    assert not any(image.any() for image in images.values())


@pytest.mark.parametrize("orthographic", [False, True])
def test_every_target_is_the_one_by_rays(gpu_device, orthographic):
    from picture_stage import stage, view

    from rtgi_addon.preview.gbuffer import GBuffer, gbuffer_surfaces
    from rtgi_addon.preview.textures import download
    from rtgi_addon.transport.views.gbuffer import GBuffer as ByRays
    from rtgi_addon.transport.views.gbuffer import draw_gbuffer
    shown, seen, size, offset = stage(), view(orthographic=orthographic), (96, 64), (0.2, -0.4)
    target = GBuffer(*size)
    target.draw(gbuffer_surfaces(shown), seen.drawn(size, offset))
    found = ByRays(**{name: download(texture) for name, texture in target.textures.items()})
    expected = draw_gbuffer(LightContext(shown, 1), seen, size, offset)
    same = found.primitive == expected.primitive
    assert same.mean() > 0.995 and np.all(np.unique(expected.material) == [-1, 0, 1])
    assert np.array_equal(found.material[same], expected.material[same])
    assert np.array_equal(found.instance[same], expected.instance[same])
    for name, array in expected.items():
        assert np.abs(getattr(found, name)[same] - array[same]).max() < 1e-3, name


@pytest.mark.parametrize("mirrored", [False, True])
def test_each_side_is_drawn_as_a_camera_sees_it(gpu_device, mirrored):
    """The front and the back of panes that differ from side to side, and one that shows itself to cameras alone."""
    back = Material("back", albedo=Channel.of((0.1, 0.2, 0.7)), emission=Channel.of(2.0))
    sides = Material("sides", albedo=Channel.of((0.6, 0.3, 0.1)), back=back)
    shown = Material("shown", alpha=Channel.of(0.0), camera=sides)
    edges = ((1, 0, 0), (0, 1, 0))
    panes = [quad("front", (-2, -1, 0), *edges), quad("back", (-0.5, -1, 0), *edges[::-1]), quad("shown", (1, -1, 0), *edges, 1)]
    lamp = SpotLight("eye", np.float32([0.0, 0.0, 3.0]), np.float32([0, 0, -1]), np.float32([1, 1, 1]), 1.6)
    scene = build.scene(panes, [sides, shown], [lamp])
    if mirrored:
        turned = build.transform(scale=(-1, 1, 1))
        scene = replace(scene, instances=tuple(replace(one, world_from_local=turned) for one in scene.instances))
    view = views_of(LightContext(scene, 1), 0, 64)[0]
    context, images = drawn(scene, view, 64)
    albedo, emission = (images[name][..., :3].reshape(-1, 3) for name in ("albedo", "emission"))
    hits = context.sight.tracer.intersect(*view.rays())
    assert np.mean(albedo.any(axis=1) == (hits.primitive >= 0)) > 0.98
    behind = np.isclose(albedo, (0.1, 0.2, 0.7)).all(axis=1)
    front = np.isclose(albedo, (0.6, 0.3, 0.1)).all(axis=1)
    assert set(hits.primitive[behind]) <= {2, 3, -1} and set(hits.primitive[front]) <= {0, 1, 4, 5, -1}
    assert front.sum() > 1.5 * behind.sum() > 20 and np.array_equal(front | behind, albedo.any(axis=1))
    assert np.allclose(emission[behind], 2.0) and not emission[front].any()
    assert context.tracer.intersect(*view.rays()).primitive.max() < 4
