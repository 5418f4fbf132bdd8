"""What objects and lamps are to bakes: the properties, Blender's own switch behind them, panels, and what extraction reads."""

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link  # noqa: E402
from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402


@pytest.fixture
def registered(empty_blend):
    """The add-on, and a file with two cubes, a collection instance of one of them, and two lamps of one datablock."""
    rtgi_addon.register()
    for name in ("box", "crate"):
        link(name, cube_mesh())
    data = bpy.data.lights.new("bulb", "POINT")
    for name in ("left", "right"):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    yield bpy.data.objects
    rtgi_addon.unregister()


def roles():
    scene = extract_scene()
    return {instance.name: instance.bake for instance in scene.instances}, {light.name: light.bake for light in scene.lights}


def test_without_a_choice_all_is_as_it_always_was(registered):
    assert roles() == ({"box": "STATIC", "crate": "STATIC"}, {"left": "BOUNCES", "right": "BOUNCES"})


def test_dynamic_is_blenders_own_switch(registered):
    box = registered["box"]
    box.rtgi.bake = "DYNAMIC"
    assert box.hide_probe_volume and roles()[0] == {"box": "DYNAMIC", "crate": "STATIC"}
    box.hide_probe_volume = False
    assert box.rtgi.bake == "STATIC"
    box.hide_probe_volume = True
    assert box.rtgi.bake == "DYNAMIC"


def test_what_is_left_out_is_as_if_the_file_did_not_have_it(registered):
    box = registered["box"]
    box.rtgi.bake = "NONE"
    assert roles()[0] == {"crate": "STATIC"} and not box.hide_render
    box.rtgi.bake = "STATIC"
    assert roles()[0] == {"box": "STATIC", "crate": "STATIC"} and not box.hide_probe_volume


def test_instances_go_by_what_makes_them(registered):
    inside = bpy.data.collections.new("inside")
    inside.objects.link(bpy.data.objects.new("copy", cube_mesh()))
    maker = bpy.data.objects.new("maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", inside
    bpy.context.scene.collection.objects.link(maker)
    assert "copy" in roles()[0]
    maker.rtgi.bake = "DYNAMIC"
    assert roles()[0]["copy"] == "DYNAMIC"
    maker.rtgi.bake = "NONE"
    assert "copy" not in roles()[0]


@pytest.mark.parametrize("role", ["ALL", "BOUNCES", "NONE"])
def test_lamps_say_what_of_them_is_baked(registered, role):
    registered["left"].data.rtgi.bake = role
    assert roles()[1] == {"left": role, "right": role}


def test_choices_are_part_of_the_fingerprint(registered):
    from rtgi_addon.blender.fingerprint import fingerprint

    def now():
        return fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())

    box, lamp = registered["box"], registered["left"].data
    seen = [now()]
    for change in (lambda: setattr(box.rtgi, "bake", "DYNAMIC"), lambda: setattr(box.rtgi, "bake", "NONE"),
                   lambda: setattr(lamp.rtgi, "bake", "ALL"), lambda: setattr(registered["crate"], "visible_diffuse", False)):
        change()
        seen.append(now())
    assert len(set(seen)) == len(seen)
    collection = bpy.data.collections.new("lit")
    registered["left"].light_linking.receiver_collection = collection
    collection.objects.link(registered["crate"])
    assert now() not in seen


def drawn(name, **context):
    from rtgi_addon.blender.ui import roles as module
    layout = Layout()
    getattr(module, name).draw(SimpleNamespace(layout=layout), SimpleNamespace(scene=bpy.context.scene, **context))
    return layout


def test_the_panels_show_the_choice(registered):
    from rtgi_addon.blender.ui.roles import RTGI_PT_light, RTGI_PT_object
    box, lamp = registered["box"], registered["left"]
    assert RTGI_PT_object.poll(SimpleNamespace(object=box)) and not RTGI_PT_object.poll(SimpleNamespace(object=lamp))
    assert RTGI_PT_light.poll(SimpleNamespace(light=lamp.data)) and not RTGI_PT_light.poll(SimpleNamespace())
    assert drawn("RTGI_PT_object", object=box).shown == ["bake"]
    assert drawn("RTGI_PT_light", light=lamp.data).shown == ["bake"]
    assert drawn("RTGI_PT_active", object=lamp).shown == ["bake"]
    assert drawn("RTGI_PT_active", object=None).texts == ["Select an object or a lamp"]
    box.rtgi.bake, registered["crate"].rtgi.bake, lamp.data.rtgi.bake = "DYNAMIC", "NONE", "ALL"
    assert drawn("RTGI_PT_active", object=box).texts == ["box", "Dynamic: 1", "Left out: 1", "Lamps in bakes as a whole: 2"]


def test_an_exported_model_lacks_what_is_left_out(registered, tmp_path):
    import json

    from rtgi_addon.blender.model import export_model
    registered["crate"].rtgi.bake = "NONE"
    export_model(tmp_path / "model.glb")
    data = (tmp_path / "model.glb").read_bytes()
    content = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
    assert {node["name"] for node in content["nodes"]} == {"box", "left", "right"}
    assert not registered["crate"].hide_render
