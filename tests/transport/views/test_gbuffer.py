"""The G-buffer by rays: places, materials and indices of what a camera sees, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from room_scenes import quad

from rtgi_addon.scene import Channel, Material, Texture
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.camera import CameraView
from rtgi_addon.transport.views.gbuffer import GBUFFER, GBuffer, _encoded, decode_material, decode_primitive, draw_gbuffer

SIZE = 20, 12


def looking_down(height=4.0, orthographic=False, near=0.5, far=50.0, lens=2.0):
    """From ``height`` straight down, +Y up in the picture."""
    pose = build.transform((0, 0, height))
    aspect = SIZE[1] / SIZE[0]
    depth = [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)]
    clip = np.array([[lens * aspect, 0, 0, 0], [0, lens, 0, 0], depth, [0, 0, -1, 0]])
    if orthographic:
        clip = np.array([[0.25 * aspect, 0, 0, 0], [0, 0.25, 0, 0], [0, 0, -2 / (far - near), -(far + near) / (far - near)],
                         [0, 0, 0, 1]])
    return CameraView(pose, clip)


def scene():
    """A textured floor below a pane that is seen from above only, one material each and one more that nothing has."""
    image = Texture("noise", np.random.default_rng(0).random((8, 8, 4)).astype(np.float32))
    tiles = Material("tiles", albedo=Channel.of((0.2, 0.4, 2.0)), emission=Channel(np.float32([5, 4, 3]), texture=image),
                     base_color=Channel.of((0.9, 0.5, 0.1)), metallic=Channel.of(0.25), roughness=Channel.of(0.75),
                     specular=Channel.of(0.04))
    floor = quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    pane = quad("pane", (-0.5, -0.5, 1), (0, 1, 0), (1, 0, 0), 2)
    return build.scene([floor, pane], [tiles, Material("unused"), Material("pane", backface_culling=True)])


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.4, -0.3)])
def test_what_is_seen_is_where_it_is_drawn(orthographic, offset):
    view, context = looking_down(orthographic=orthographic), LightContext(scene(), 1)
    found = draw_gbuffer(context, view, SIZE, offset)
    assert found.size == SIZE and 0.1 < found.seen.mean() < 1.0
    y, x = np.nonzero(found.seen)
    place, w = view.project(found.position[found.seen][:, :3], SIZE, offset)
    assert np.all(w > 0)
    assert np.allclose(place * SIZE, np.stack([x, y], axis=1) + 0.5, atol=1e-3)
    assert np.abs(found.position[found.seen][:, 2]).max() < 1e-6
    # Shifting the picture to the right shows what lies further to the left.
    moved = draw_gbuffer(context, view, SIZE, (offset[0] + 1.0, offset[1]))
    assert np.allclose(moved.position[:, 1:], found.position[:, :-1], atol=1e-4)


def test_every_input_of_a_material_is_in_its_place():
    context = LightContext(scene(), 1)
    found = draw_gbuffer(context, looking_down(), SIZE)
    seen = found.seen
    assert np.allclose(found.normal[seen][:, :3], (0, 0, 1)) and np.allclose(found.geometry[seen][:, :3], (0, 0, 1))
    assert np.allclose(found.albedo[seen][:, :3], (0.2, 0.4, 0.998))
    assert np.allclose(found.base_color[seen], (0.9, 0.5, 0.1, 0.25))
    assert np.allclose(found.emission[seen][:, 3], 0.75) and np.allclose(found.geometry[seen][:, 3], 0.04)
    assert np.ptp(found.emission[seen][:, 0]) > 1.0
    # The pane is seen from behind, where it is culled.
    assert np.all(found.instance[seen] == 0) and np.all(found.material[seen] == 0)
    assert set(np.unique(found.primitive[seen])) == {0, 1}
    for indices in (found.instance, found.material, found.primitive):
        assert np.all(indices[~seen] == -1)
    assert not any(array[~seen].any() for _, array in found.items())


def test_fronts_and_uncullled_backs_are_seen():
    facing = scene()
    facing = replace(facing, materials=(*facing.materials[:2], Material("pane")))
    found = draw_gbuffer(LightContext(facing, 1), looking_down(), SIZE)
    pane = found.instance == 1
    assert pane.any() and np.all(found.material[pane] == 2) and np.all(np.isin(found.primitive[pane], (2, 3)))
    # Its normal is on the side that is seen, although the mesh's front is the other one.
    assert np.allclose(found.normal[pane][:, :3], (0, 0, 1)) and np.allclose(found.position[pane][:, 2], 1.0)


def test_nothing_nearer_than_the_near_plane_or_beyond_the_far_one_is_seen():
    context = LightContext(replace(scene(), materials=(Material("floor"), Material("unused"), Material("pane"))), 1)
    assert np.any(draw_gbuffer(context, looking_down(near=2.9), SIZE).instance == 1)
    assert not np.any(draw_gbuffer(context, looking_down(near=3.1), SIZE).instance == 1)
    assert draw_gbuffer(context, looking_down(far=4.1), SIZE).seen.any()
    assert not np.any(draw_gbuffer(context, looking_down(near=3.5, far=3.9), SIZE).seen)


def test_threads_change_nothing():
    one, many = (draw_gbuffer(LightContext(scene(), threads), looking_down(), SIZE) for threads in (1, 3))
    for name, array in one.items():
        assert np.array_equal(array, getattr(many, name)), name


def test_indices_come_out_as_they_went_in():
    primitive = np.array([0, 1, 65534, 65535, 65536, 2**31 - 2], np.int64)[None]
    for material in (0, 1, 255, 256, 65535):
        high, low = _encoded(primitive, np.full_like(primitive, material))
        position, normal = (np.zeros((1, 6, 4), np.float32) for _ in range(2))
        position[..., 3], normal[..., 3] = high, low
        assert np.array_equal(decode_primitive(position, normal), primitive)
        assert np.all(decode_material(position, normal) == material)
    nothing = np.zeros((1, 1, 4), np.float32)
    assert decode_primitive(nothing, nothing)[0, 0] == -1
    # More materials than fit share the last index.
    high, low = _encoded(primitive, np.full_like(primitive, 70000))
    position[..., 3], normal[..., 3] = high, low
    assert np.all(decode_material(position, normal) == 65535) and np.array_equal(decode_primitive(position, normal), primitive)


def test_the_names_are_those_of_the_gpu():
    from rtgi_addon.preview.programs import SURFACE_PASSES
    assert SURFACE_PASSES["gbuffer"][1] == GBUFFER == tuple(GBuffer.__dataclass_fields__)
