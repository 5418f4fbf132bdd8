"""Material lookups at hits: textures as Blender reads them, vertex colours, per-instance materials, shading normals."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.scene import Channel, Instance, Material, Texture
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import MAX_ALBEDO, Surfaces
from rtgi_addon.transport.surfaces.textures import TextureSampler

SQUARE_UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)


def sample_texture(texture, uv, component="rgb"):
    return TextureSampler(texture).sample(uv, component)


def textured_plane(channel, **mesh_options):
    """Lookups of the albedo ``channel`` on a unit-UV square, by UV coordinates."""
    scene = build.scene([build.plane()], [Material("m", albedo=channel)])
    options = {"uv_layers": {"UV": SQUARE_UV}, "active_uv": "UV"} | mesh_options
    scene = replace(scene, meshes=(replace(scene.meshes[0], **options),))
    surfaces = Surfaces(scene, flatten(scene))

    def look_up(uv):
        x, y = np.asarray(uv, np.float32).T
        lower = y <= x
        # Corners (0,0), (1,0), (1,1) below the diagonal and (0,0), (1,1), (0,1) above it.
        primitive = np.where(lower, 0, 1).astype(np.int32)
        return surfaces.albedo(primitive, np.where(lower, x - y, x), np.where(lower, y, y - x), np.ones(len(x), np.float32))

    return look_up


def gradient(width=4, height=2):
    """Red counts columns, green counts rows from the bottom."""
    pixels = np.zeros((height, width, 3), np.float32)
    pixels[..., 0], pixels[..., 1] = np.arange(width) / 8, np.arange(height)[:, None] / 8
    return pixels


def test_texels_are_read_at_their_centres_with_row_zero_at_the_bottom():
    look_up = textured_plane(Channel(texture=Texture("t", gradient())))
    uv = [((column + 0.5) / 4, (row + 0.5) / 2) for row in range(2) for column in range(4)]
    np.testing.assert_allclose(look_up(uv), gradient().reshape(-1, 3), atol=1e-6)


@pytest.mark.parametrize(("extension", "expected"), [("REPEAT", 1.5), ("EXTEND", 3.0), ("CLIP", 1.5), ("MIRROR", 3.0)])
def test_edges_interpolate_by_the_extension(extension, expected):
    """At u = 1 half of the footprint is column 3; the other half is column 0, column 3, black, or column 3."""
    texture = Texture("t", gradient(), extension=extension)
    value = sample_texture(texture, np.array([[1.0, 0.25]], np.float32))
    np.testing.assert_allclose(value[0, 0] * 8, expected, atol=1e-4)


def test_extension_far_outside():
    far = np.array([[2.125, 0.25], [-0.875, 0.25], [1.375, 0.25]], np.float32)
    reds = {extension: sample_texture(Texture("t", gradient(), extension=extension), far)[:, 0] * 8
            for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR")}
    np.testing.assert_allclose(reds["REPEAT"], [0, 0, 1], atol=1e-4)
    np.testing.assert_allclose(reds["EXTEND"], [3, 0, 3], atol=1e-4)
    np.testing.assert_allclose(reds["CLIP"], [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(reds["MIRROR"], [0, 3, 2], atol=1e-4)


def test_closest_takes_one_texel():
    texture = Texture("t", gradient(), interpolation="Closest")
    value = sample_texture(texture, np.array([[0.49, 0.4], [0.51, 0.6]], np.float32))
    np.testing.assert_allclose(value[:, :2] * 8, [[1, 0], [2, 1]])


def decoded(code):
    """The sRGB transfer function (IEC 61966-2-1)."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def test_srgb_bytes_are_filtered_as_stored_and_then_decoded_but_alpha_is_not():
    """Half way between black and code 188 Cycles reads decode(94), not half of decode(188)."""
    pixels = np.zeros((1, 2, 4), np.uint8)
    pixels[0, 1] = 255, 188, 0, 188
    texture = Texture("t", pixels, srgb=True)
    middle = np.array([[0.5, 0.5]], np.float32)
    expected = decoded(np.array([127.5, 94.0, 0.0]) / 255)
    np.testing.assert_allclose(sample_texture(texture, middle), [expected], atol=1e-6)
    np.testing.assert_allclose(sample_texture(texture, middle, "g"), [expected[[1, 1, 1]]], atol=1e-6)
    np.testing.assert_allclose(sample_texture(texture, middle, "a")[:, 0], 0.5 * 188 / 255, atol=1e-6)
    np.testing.assert_allclose(sample_texture(Texture("t", pixels), middle)[0, 1], 0.5 * 188 / 255, atol=1e-6)


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_half_floats_are_filtered_as_floats_are(channels, interpolation):
    pixels = np.random.default_rng(channels).uniform(-1.0, 40.0, (5, 7, channels)).astype(np.float16)
    uv = np.random.default_rng(0).uniform(-1.0, 2.0, (200, 2)).astype(np.float32)
    half, full = (sample_texture(Texture("t", pixels.astype(kind), interpolation=interpolation), uv)
                  for kind in (np.float16, np.float32))
    assert half.dtype == np.float32
    np.testing.assert_allclose(half, full, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_every_srgb_code_is_decoded_at_its_texels_centre(kind, interpolation):
    codes = np.arange(256, dtype=np.uint8).reshape(1, 256, 1)
    pixels = codes if kind is np.uint8 else (codes / 255).astype(np.float32)
    uv = np.stack([(np.arange(256) + 0.5) / 256, np.full(256, 0.5)], axis=1).astype(np.float32)
    value = sample_texture(Texture("t", pixels, srgb=True, interpolation=interpolation), uv)
    np.testing.assert_allclose(value, np.repeat(decoded(np.arange(256) / 255)[:, None], 3, axis=1), atol=3e-6)
    assert value.dtype == np.float32


def test_a_channel_is_constant_times_texture_times_attribute_plus_offset():
    attribute = np.ones((2, 3, 4), np.float32) * [0.5, 1.0, 0.25, 1.0]
    channel = Channel(np.float32([1, 0.5, 1]), Texture("t", np.full((2, 2, 3), 0.8, np.float32)), attribute="Col",
                      offset=np.float32([0.1, 0, 0]))
    look_up = textured_plane(channel, attributes={"Col": attribute.astype(np.float32)})
    np.testing.assert_allclose(look_up([[0.3, 0.6]]), [[0.5, 0.4, 0.2]], atol=1e-6)


def test_uv_transform_comes_before_the_texture():
    """Turn by 90° and shift: (u, v) → (v, 1 − u)."""
    channel = Channel(texture=Texture("t", gradient(4, 4)), uv_transform=np.array([[0, 1, 0], [-1, 0, 1]], np.float32))
    np.testing.assert_allclose(textured_plane(channel)([[0.125, 0.625]]) * 8, [[2, 3, 0]], atol=1e-4)


def test_vertex_colours_interpolate_and_are_black_where_missing():
    corners = np.zeros((2, 3, 4), np.float32)
    corners[:, :, 0] = SQUARE_UV[:, :, 0]
    look_up = textured_plane(Channel(attribute="Col"), attributes={"Col": corners})
    np.testing.assert_allclose(look_up([[0.25, 0.1], [0.25, 0.9]])[:, 0], 0.25, atol=1e-6)
    assert not textured_plane(Channel(attribute="other"))([[0.2, 0.2]]).any()


def test_albedo_is_capped_and_never_negative():
    look_up = textured_plane(Channel(np.float32([3.0, -1.0, 0.5]), offset=np.float32([0, 0, 0.1])))
    np.testing.assert_allclose(look_up([[0.5, 0.2]]), [[MAX_ALBEDO, 0.0, 0.6]], atol=1e-6)


def test_instances_may_override_materials():
    red, blue = Material("red", albedo=Channel.of([0.9, 0, 0])), Material("blue", albedo=Channel.of([0, 0, 0.9]))
    scene = build.scene([build.plane()], [red, blue])
    scene = replace(scene, instances=(Instance("a", 0, np.eye(4)), Instance("b", 0, build.transform((5, 0, 0)), {0: 1})))
    surfaces = Surfaces(scene, flatten(scene))
    zero = np.zeros(2, np.float32)
    np.testing.assert_allclose(surfaces.albedo(np.array([0, 2]), zero, zero, zero + 1), [[0.9, 0, 0], [0, 0, 0.9]])


def test_shading_normals_of_a_stretched_smooth_sphere():
    """Corner normals go with the inverse transpose: on an ellipsoid they are the gradient of its equation, mirrored or not."""
    sphere = build.sphere(subdivisions=3)
    sphere = replace(sphere, corner_normals_local=sphere.vertices_local[sphere.triangles])
    for scale in ((1.0, 2.0, 0.5), (-1.0, 2.0, 0.5)):
        scene = replace(build.scene([sphere]), instances=(Instance("e", 0, build.transform(scale=scale)),))
        geometry = flatten(scene)
        primitive = np.arange(geometry.count)
        third = np.full(geometry.count, 1 / 3, np.float32)
        normals = Surfaces(scene, geometry).shading_normal(primitive, third, third)
        gradient_of = geometry.points(primitive, third, third) / np.square(scale)
        gradient_of /= np.linalg.norm(gradient_of, axis=1, keepdims=True)
        np.testing.assert_allclose(np.sum(normals * gradient_of, axis=1), 1.0, atol=2e-4)
        assert np.all(np.sum(normals * geometry.normals_world, axis=1) > 0.9)


def test_flat_meshes_beside_smooth_ones_keep_their_face_normals():
    sphere = build.sphere(subdivisions=0)
    smooth = replace(sphere, corner_normals_local=sphere.vertices_local[sphere.triangles])
    scene = build.scene([build.cube(), smooth])
    geometry = flatten(scene)
    third = np.full(geometry.count, 0.2, np.float32)
    normals = Surfaces(scene, geometry).shading_normal(np.arange(geometry.count), third, third)
    np.testing.assert_array_equal(normals[:12], geometry.normals_world[:12])
    assert np.all(np.abs(np.sum(normals[12:] * geometry.normals_world[12:], axis=1)) < 0.9999)
