"""A scene as a document and arrays, and back."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.scene import Camera, Omission, PointLight, World
from rtgi_addon.scene.content import content_hash
from rtgi_addon.scene.encoding import ENCODED, KINDS, decode, encode
from rtgi_addon.scene.lamp_profile import LampProfile
from rtgi_addon.scene.lights import AreaLight, SpotLight, SunLight
from rtgi_addon.scene.linking import Linking
from rtgi_addon.scene.material import Channel, Material, Texture
from rtgi_addon.scene.medium import ClosedMesh, DensityGrid, Medium, Phase
from rtgi_addon.scene.scattered import Scattered
from rtgi_addon.scene.scene import Instance, Mesh, Mist, NearSurfaces
from rtgi_addon.scene.sphere_probe import SphereProbe
from rtgi_addon.storage.parse import Refused


def rich():
    """A scene with something of every kind, shared and not, and of every type of value."""
    texture = Texture("bricks", np.arange(48, dtype=np.uint8).reshape(4, 4, 3), srgb=True)
    albedo = Channel(texture=texture, uv_transform=np.eye(2, 3))
    back = Material("back", albedo=albedo)
    material = Material("wall", albedo=albedo, back=back, camera=replace(back, name="camera"), alpha_threshold=0.5,
                        albedo_by_angle=np.ones((4, 3), np.float32), line_color=(1.0, 0.5, 0.0, 1.0), pass_index=3)
    mesh = Mesh("mesh", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32),
                uv_layers={"UV": np.zeros((1, 3, 2), np.float32)}, active_uv="UV", marked_edges=np.array([[0, 1]], np.int32))
    linking = Linking(np.array([True]), None)
    lights = (SunLight("sun", np.array([0.0, 0.0, -1.0]), np.ones(3, np.float32), max_bounces=2),
              PointLight("point", np.zeros(3), np.ones(3, np.float32), linking=linking, light_group="Street",
                         profile=LampProfile(by_distance=np.ones((4, 3), np.float32))),
              SpotLight("spot", np.zeros(3), np.array([0.0, 0.0, -1.0]), np.ones(3), 1.0),
              AreaLight("area", np.zeros(3), np.eye(3)[0], np.eye(3)[1], -np.eye(3)[2], np.ones(3)))
    media = (Medium("fog", scattering=np.full(3, 0.1), phase=Phase("DRAINE", 0.5), bounds=ClosedMesh(
        mesh.vertices_local, mesh.triangles, np.eye(4)), grid=DensityGrid(np.eye(4), np.ones((2, 2, 2), np.float32))),)
    volume = build.volume(resolution=(2, 3, 2), half_size=0.9)
    return replace(
        build.scene([mesh], lights=lights, volumes=(replace(
            volume, settings={"error": 0.1, "rays": None}, near=NearSurfaces(0.1, 0.0, True), wanted=np.zeros((2, 3, 2), bool),
            scattered=Scattered(np.zeros((2, 2, 2, 4), np.int32), np.ones((3, 3)), np.ones(3, np.float32))),)),
        materials=(material,), instances=(Instance("mesh", 0, np.eye(4), {0: 0}, collections=("A", "B"), linking=linking),),
        world=World.constant((1.0, 0.5, 0.2)), mist=Mist(1.0, float("inf"), "quadratic"), media=media,
        cameras=(Camera("camera", np.eye(4), np.eye(4), (64, 32)),),
        spheres=(SphereProbe("mirror", np.eye(4), influence_shape="box"),),
        omissions=(Omission("hair is not followed", ("head",), boxes_world=np.zeros((1, 2, 3))),), files=("a.blend",))


def travelled(scene):
    document, arrays = encode(scene)
    document = json.loads(json.dumps(document, allow_nan=False))
    ENCODED(document, "scene")
    return decode(document, arrays)


def every_field(value):
    """Everything in it, fields that are no light among them, as text."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tolist()}"
    if type(value).__name__ in KINDS:
        return f"{type(value).__name__}{[(item.name, every_field(getattr(value, item.name))) for item in fields(value)]}"
    if isinstance(value, (tuple, list)):
        return f"{type(value).__name__}({', '.join(map(every_field, value))})"
    if isinstance(value, dict):
        return f"dict({', '.join(f'{key!r}: {every_field(item)}' for key, item in value.items())})"
    return repr(value)


@pytest.mark.parametrize("scene", [rich(), rooms.two_rooms(), rooms.textured_room(), rooms.courtyard()])
def test_a_scene_comes_back_as_it_was(scene):
    again = travelled(scene)
    assert content_hash(again) == content_hash(scene)
    assert every_field(again) == every_field(scene)


def test_every_kind_was_tried():
    document, _ = encode(rich())
    assert {entry["kind"] for entry in document["objects"]} == set(KINDS)


def test_what_is_shared_stays_shared():
    scene = rich()
    document, arrays = encode(scene)
    again = travelled(scene)
    material = again.materials[0]
    assert material.albedo is material.back.albedo and material.back.albedo.texture is material.camera.albedo.texture
    assert again.instances[0].linking is again.lights[1].linking
    assert sum(array is scene.materials[0].albedo.texture.pixels for array in arrays.values()) == 1
    assert sum(entry["kind"] == "Texture" for entry in document["objects"]) == 1


def test_what_no_scene_is_made_of_is_not_written():
    with pytest.raises(TypeError, match="nothing that a scene is made of"):
        encode(replace(rooms.two_rooms(), source=object()))


@pytest.mark.parametrize(("change", "said"), [
    (lambda document: document["objects"][0].update(kind="Popen"), "unknown kind"),
    (lambda document: document["objects"][0]["fields"].popitem(), "other fields"),
    (lambda document: document["objects"][-1]["fields"].update(name={"array": "no such"}), "stands for nothing"),
    (lambda document: document["objects"][-1]["fields"].update(name={"object": 10**6}), "stands for nothing"),
    (lambda document: document["objects"][-1]["fields"].update(name={"object": True}), "stands for nothing"),
    (lambda document: document["objects"][-1]["fields"].update(name=["a"]), "bare list"),
    (lambda document: document["objects"][-1]["fields"].update(name={"float": "1e999"}), "stands for nothing"),
    (lambda document: document["objects"][-1]["fields"].update(name={"pairs": [[{"tuple": []}, 1]]}), "stands for nothing"),
    (lambda document: document["objects"].clear(), "no object"),
])
def test_a_document_that_was_changed_is_refused(change, said):
    document, arrays = encode(rooms.two_rooms())
    change(document)
    with pytest.raises(Refused, match=said):
        decode(document, arrays)
