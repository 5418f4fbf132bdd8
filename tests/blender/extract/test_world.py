"""The extracted world against Cycles: irradiance on squares facing several ways, and exact answers."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import addon_utils  # noqa: E402
from cycles_irradiance import cycles_irradiance  # noqa: E402

from rtgi_addon.blender.extract.panorama import render_panorama  # noqa: E402
from rtgi_addon.blender.extract.world import read_world  # noqa: E402
from rtgi_addon.scene import World  # noqa: E402
from rtgi_addon.transport.lights.environment import Environment  # noqa: E402

FACINGS = [(0, 0, 1), (1, 0, 0), (0, 1, 0), (-0.5, -0.7, -0.4)]


@pytest.fixture
def nodes(empty_blend):
    """An empty file with a world of just a Background and an output: its node tree."""
    addon_utils.enable("cycles")
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    # Cycles' own choice of importance map takes over a second to build.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 256
    tree = world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return tree


def background(tree):
    return next(node for node in tree.nodes if node.type == "BACKGROUND")


def square_facing(normal):
    """world_from_square (4, 4) of a square whose +Z looks along ``normal``."""
    z = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    x = np.cross((0.3, 0.5, 0.8), z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return matrix


def irradiance(world: World, normal):
    """∫ L max(0, n·d) dω over the texels of the map, by their exact solid angles, from the contract's formulas alone."""
    equirect = np.broadcast_to(world.equirect, (64, 128, 3)) if world.equirect.size == 3 else world.equirect
    height, width = equirect.shape[:2]
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    elevation = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    direction_map = np.stack([np.cos(elevation)[:, None] * np.cos(azimuth), np.cos(elevation)[:, None] * np.sin(azimuth),
                              np.repeat(np.sin(elevation)[:, None], width, axis=1)], axis=-1)
    solid_angle = np.diff(np.sin((np.arange(height + 1) / height - 0.5) * np.pi)) * 2 * np.pi / width
    cosine = np.maximum(direction_map @ world.map_from_world @ (np.asarray(normal) / np.linalg.norm(normal)), 0.0)
    return np.einsum("hwc,hw->c", equirect, cosine * solid_angle[:, None])


def agree(tolerance, facings=FACINGS, samples=1024):
    """Assert that the extracted world lights squares as Cycles does, relative to the brightest of them; return it."""
    world = read_world(bpy.context.scene.world, [])
    expected = np.array([cycles_irradiance(square_facing(n), 1.0, 4, samples).mean(axis=(0, 1)) for n in facings])
    ours = np.array([irradiance(world, n) for n in facings])
    assert expected.max() > 0
    np.testing.assert_allclose(ours, expected, rtol=0, atol=tolerance * expected.max())
    return world


def picture(alpha=1.0):
    """A lopsided float image (64 × 32): every direction differs, no symmetry hides a wrong turn."""
    v, u = np.mgrid[0:32, 0:64]
    pixels = np.empty((32, 64, 4), np.float32)
    pixels[..., 0] = 0.2 + u / 64
    pixels[..., 1] = 0.1 + v / 16
    pixels[..., 2] = 0.3 + 0.25 * np.cos(3 * u * 2 * np.pi / 64) * np.sin(v * np.pi / 32)
    pixels[18:24, 10:16] *= 8.0
    pixels[..., 3] = alpha
    image = bpy.data.images.new("surroundings", 64, 32, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    return image


def environment(tree, image, projection="EQUIRECTANGULAR", rotation=None, vector_type="POINT"):
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image, node.projection = image, projection
    tree.links.new(node.outputs["Color"], background(tree).inputs["Color"])
    if rotation is not None:
        mapping, coordinate = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
        mapping.vector_type = vector_type
        mapping.inputs["Rotation"].default_value = rotation
        tree.links.new(coordinate.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    return node


def test_no_world_is_black():
    assert read_world(None, []).is_black


def test_constant_background(nodes):
    background(nodes).inputs["Color"].default_value = (0.25, 0.5, 1.0, 1.0)
    background(nodes).inputs["Strength"].default_value = 3.0
    world = read_world(bpy.context.scene.world, [])
    np.testing.assert_allclose(world.equirect, [[[0.75, 1.5, 3.0]]])


def test_unlinked_output_is_black(nodes):
    nodes.links.clear()
    assert read_world(bpy.context.scene.world, []).is_black


def test_world_unseen_by_diffuse_rays_is_black(nodes):
    bpy.context.scene.world.cycles_visibility.diffuse = False
    assert read_world(bpy.context.scene.world, []).is_black


MAPPINGS = {"straight": (None, "POINT"), "turned": ((0, 0, 0.8), "POINT"), "point": ((0.6, -0.3, 2.1), "POINT"),
            "texture": ((0.6, -0.3, 2.1), "TEXTURE"), "vector": ((0.6, -0.3, 2.1), "VECTOR")}


@pytest.mark.parametrize(("rotation", "vector_type"), MAPPINGS.values(), ids=MAPPINGS.keys())
def test_environment_texture(nodes, rotation, vector_type):
    environment(nodes, picture(), rotation=rotation, vector_type=vector_type)
    background(nodes).inputs["Strength"].default_value = 1.7
    world = agree(0.006)
    assert world.equirect.shape == (32, 64, 3) and "surroundings" in world.description


def test_bilinear_lookup_equals_cycles_panorama(nodes):
    environment(nodes, picture(), rotation=(0.6, -0.3, 2.1))
    world = read_world(bpy.context.scene.world, [])
    panorama = render_panorama(bpy.context.scene.world, 256)
    directions = np.random.default_rng(1).normal(size=(4000, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    direct, rendered = (Environment(w).radiance(directions) for w in (world, World(panorama)))
    assert np.median(np.abs(direct - rendered)) < 0.002
    assert np.mean(np.abs(direct - rendered)) < 0.01


def test_mirror_ball(nodes):
    environment(nodes, picture(), projection="MIRROR_BALL")
    assert agree(0.006).equirect.shape == (512, 1024, 3)


def test_image_with_transparency(nodes):
    environment(nodes, picture(alpha=0.5))
    agree(0.006)


def test_scaled_mapping(nodes):
    node = environment(nodes, picture(), rotation=(0, 0, 0.5))
    node.inputs["Vector"].links[0].from_node.inputs["Scale"].default_value = (1.0, 2.0, 0.5)
    agree(0.006)


@pytest.mark.parametrize("elevation", [0.1, 0.9])
def test_sky_texture_keeps_the_sun(nodes, elevation):
    bpy.context.scene.world.cycles.sampling_method = "AUTOMATIC"  # the sun is a lamp of its own then
    sky = nodes.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation, sky.sun_disc = elevation, 2.0, True
    nodes.links.new(sky.outputs[0], background(nodes).inputs["Color"])
    world = agree(0.004, samples=2048)
    assert world.equirect.max() > 1e4


def test_light_path_shows_what_diffuse_rays_see(nodes):
    path, mix, group = (nodes.nodes.new(kind) for kind in ("ShaderNodeLightPath", "ShaderNodeMixRGB", "ShaderNodeGroup"))
    inner = bpy.data.node_groups.new("bright only for diffuse", "ShaderNodeTree")
    inner.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    inner_path, inner_output = inner.nodes.new("ShaderNodeLightPath"), inner.nodes.new("NodeGroupOutput")
    inner.links.new(inner_path.outputs["Is Diffuse Ray"], inner_output.inputs[0])
    group.node_tree = inner
    mix.inputs["Color1"].default_value, mix.inputs["Color2"].default_value = (0.2, 0.4, 0.6, 1), (9, 0, 0, 1)
    nodes.links.new(path.outputs["Is Camera Ray"], mix.inputs["Fac"])
    nodes.links.new(mix.outputs[0], background(nodes).inputs["Color"])
    nodes.links.new(group.outputs[0], background(nodes).inputs["Strength"])
    world = read_world(bpy.context.scene.world, [])
    np.testing.assert_allclose(world.equirect, np.broadcast_to([0.2, 0.4, 0.6], world.equirect.shape), rtol=1e-5)
    assert inner.users == 1 and group.node_tree == inner


def test_missing_image_is_named(nodes):
    image = bpy.data.images.new("gone", 4, 4)
    image.source, image.filepath = "FILE", "//not_there.exr"
    environment(nodes, image)
    notes = []
    world = read_world(bpy.context.scene.world, notes)
    np.testing.assert_allclose(world.equirect, [[[1.0, 0.0, 1.0]]])
    assert len(notes) == 1 and "gone" in notes[0] and "not_there.exr" in notes[0]
    agree(1e-3)


def test_panorama_leaves_no_trace(nodes):
    nodes.links.new(nodes.nodes.new("ShaderNodeTexSky").outputs[0], background(nodes).inputs["Color"])
    scene = bpy.context.scene
    kinds = ("scenes", "worlds", "cameras", "objects", "images", "node_groups", "collections", "materials")
    bpy.data.images.new("mine", 2, 2)

    def state():
        kept = {kind: sorted(item.name for item in getattr(bpy.data, kind) if item.name not in {"Render Result", "Viewer Node"})
                for kind in kinds}
        return kept, scene.render.engine, scene.render.filepath, scene.render.resolution_x, scene.camera, bpy.context.scene

    before = state()
    world = read_world(scene.world, [])
    assert state() == before
    assert not world.is_black and math.isfinite(float(world.equirect.sum()))
