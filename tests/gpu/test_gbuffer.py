"""The G-buffer against rays through the texels' centres and the materials at their hits."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from room_scenes import quad

from rtgi_addon.scene import Channel, Instance, Material, PointLight, SpotLight, Texture
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.shadow_views import views_of

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
    from rtgi_addon.preview.surfaces import View
    from rtgi_addon.preview.textures import download
    context = LightContext(scene, 1)
    target = GBuffer(resolution, resolution)
    target.draw(gbuffer_surfaces(scene), View(view.clip_from_world, view.world_from_view, view.far, False))
    return context, {name: download(texture) for name, texture in target.textures.items()}


def test_every_input_of_a_material_arrives(gpu_device, scene):
    from rtgi_addon.preview.surfaces import decode_primitive
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


@pytest.mark.parametrize(("mirrored", "flipped"), [(False, False), (False, True), (True, False), (True, True)])
def test_backs_are_left_out_of_mirrored_instances_too(gpu_device, scene, mirrored, flipped):
    from rtgi_addon.preview.surfaces import decode_primitive
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
