"""Exports from Blender's sidebar, and from the command line with a file."""

import json
import struct
from types import SimpleNamespace

import pytest
from scene_builders import closed_box

from rtgi_addon.blender.cli.base import Session
from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser
from rtgi_addon.exchange.bundle import write_bundle
from rtgi_addon.exchange.engines.conformance import kit_field
from rtgi_addon.progress import Progress

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")


@pytest.fixture
def registered(empty_blend, tmp_path):
    """The add-on with a bundle in its output folder and a cube, a lamp and a camera in the scene; the folder around both."""
    import rtgi_addon
    rtgi_addon.register()
    write_bundle(tmp_path / "bake", kit_field(), closed_box(), settings={}, seed=0, stats=lambda: {"rays": 0})
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    bpy.context.scene.rtgi_export.folder = str(tmp_path / "game")
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = "Crate"
    bpy.ops.object.light_add(type="POINT", location=(0.0, 0.0, 3.0))
    bpy.ops.object.camera_add()
    yield tmp_path
    rtgi_addon.unregister()


def nodes_of(glb):
    """The names of a .glb's nodes."""
    data = glb.read_bytes()
    assert data[:4] == b"glTF"
    (length,) = struct.unpack_from("<I", data, 12)
    return {node["name"] for node in json.loads(data[20:20 + length])["nodes"]}


def test_the_button_exports_the_bake_with_the_scene_as_model(registered):
    assert bpy.ops.rtgi.export() == {"FINISHED"}
    marker = json.loads((registered / "game/rtgi_export.json").read_text())
    assert marker["engine"] == bpy.context.scene.rtgi_export.engine == "godot"
    assert {"Crate", "Camera", "Point"} <= nodes_of(registered / "game/model.glb")


def test_what_does_not_render_stays_out_of_the_model(registered):
    bpy.data.objects["Crate"].hide_render = True
    assert bpy.ops.rtgi.export() == {"FINISHED"}
    assert "Crate" not in nodes_of(registered / "game/model.glb")


@pytest.mark.parametrize("engine", ["godot", "threejs"])
def test_without_the_model(registered, engine):
    bpy.context.scene.rtgi_export.engine = engine
    bpy.context.scene.rtgi_export.model = False
    assert bpy.ops.rtgi.export() == {"FINISHED"}
    assert not (registered / "game/model.glb").exists()


def test_a_folder_with_something_else_in_it_is_left_alone(registered):
    (registered / "game").mkdir()
    (registered / "game/mine.txt").write_text("keep")
    with pytest.raises(RuntimeError, match=r"mine\.txt"):
        bpy.ops.rtgi.export()
    assert [item.name for item in (registered / "game").iterdir()] == ["mine.txt"]


def test_a_relative_folder_of_an_unsaved_file_is_refused(registered):
    bpy.context.scene.rtgi_export.folder = "//game"
    with pytest.raises(RuntimeError, match="never saved"):
        bpy.ops.rtgi.export()


def test_area_lamps_are_missed_by_name_unless_their_light_is_baked(registered):
    from rtgi_addon.jobs.export import export_bundle
    bpy.ops.object.light_add(type="AREA", location=(0.0, 0.0, 3.0))
    bpy.context.object.name = "Window"
    from rtgi_addon.blender.model import export_model
    notes = export_model(registered / "model.glb")
    assert notes == ("glTF has no area lamps: the model lacks Window",)
    report = export_bundle(registered / "bake", "godot", registered / "out", model=registered / "model.glb", model_notes=notes)
    assert report.notes == notes
    manifest = json.loads((registered / "bake/bake.json").read_text())
    (registered / "bake/bake.json").write_text(json.dumps({**manifest, "includes_direct": True}))
    assert export_bundle(registered / "bake", "godot", registered / "out", model_notes=notes).notes == ()


def test_without_a_bundle_there_is_no_button(registered):
    bpy.context.scene.rtgi.output = str(registered / "nowhere")
    assert not bpy.ops.rtgi.export.poll()


def test_the_panel_shows_engine_folder_and_button(registered):
    from panel_layout import Layout
    layout = Layout()
    bpy.types.RTGI_PT_export.draw(SimpleNamespace(layout=layout), bpy.context)
    assert layout.shown == ["engine", "folder", "model", "rtgi.export"]


def test_the_shell_takes_a_file_or_none(registered, tmp_path):
    export = SUBCOMMANDS["export"]
    arguments = build_parser("rtgi").parse_args(["export", str(registered / "bake"), "--engine", "godot", "--out",
                                                 str(tmp_path / "out")])
    opened = []
    alone = export.run(arguments, Session(Progress(), None, False, lambda: opened.append(True)))
    assert not opened and "model.glb" not in alone.files
    report = export.run(arguments, Session(Progress(), None, True, lambda: opened.append(True)))
    assert opened == [True] and "Crate" in nodes_of(report.out / "model.glb")
    assert report.to_json()["engine"] == "godot" and str(tmp_path / "out") in report.to_text()
