"""Exports from Blender's sidebar, and from the command line with a file."""

import json
import struct
from types import SimpleNamespace

import pytest
from scene_builders import closed_box
from small_bundles import edit_manifest

from rtgi_addon.blender.cli.base import Session
from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser
from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.bundle import write_bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.progress import Progress

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")


@pytest.fixture
def registered(empty_blend, tmp_path):
    """The add-on with a bundle in its output folder and a cube, a lamp and a camera in the scene; the folder around both."""
    import rtgi_addon
    rtgi_addon.register()
    write_bundle(tmp_path / "bake", kit_field(), closed_box(), settings={}, seed=0, stats=lambda: {"rays": 0})
    edit_manifest(tmp_path / "bake", lambda manifest: manifest.update(scene=bpy.context.scene.name, technique="probes"))
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


def test_only_the_probes_go_into_a_project(registered):
    (registered / "game").mkdir()
    (registered / "game/project.godot").write_text("mine")
    bpy.context.scene.rtgi_export.part = "files"
    assert bpy.ops.rtgi.export() == {"FINISHED"}
    assert sorted(item.name for item in (registered / "game").iterdir()) == ["project.godot", "rtgi"]
    assert (registered / "game/project.godot").read_text() == "mine"


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
    missing, even, lost, _ = export_model(registered / "model.glb")
    assert (missing, even, lost) == (("Window",), (), ())
    report = export_bundle(registered / "bake", "godot", registered / "out", model=registered / "model.glb", missing_lamps=missing)
    note, = report.notes
    assert note.startswith("glTF has no area lamps, the model lacks Window: bake with direct light (--direct")
    edit_manifest(registered / "bake", lambda manifest: manifest.update(includes_direct=True, lamps={"Window": "all"}))
    assert export_bundle(registered / "bake", "godot", registered / "out", missing_lamps=missing).notes == ()


def test_without_a_bundle_there_is_no_button(registered):
    bpy.context.scene.rtgi.output = str(registered / "nowhere")
    assert not bpy.ops.rtgi.export.poll()


def test_the_panel_says_which_bundle_goes_and_that_it_is_out_of_date(registered):
    from rtgi_addon.blender.session import session
    bpy.context.scene.rtgi.last_bake.folder = str(registered / "bake")
    assert "bake: Irradiance Probes, " in drawn()[0] and "Out of date" not in drawn()[0]
    session.stale[bpy.context.scene.name] = True
    assert "Out of date" in drawn()[0] and bpy.ops.rtgi.export() == {"FINISHED"}


@pytest.mark.parametrize(("about", "said"), [({"scene": "Cellar"}, "is of scene 'Cellar'"),
                                             ({"technique": "vpl"}, "technique vpl")])
def test_a_bundle_that_is_not_shown_is_never_exported(registered, about, said):
    edit_manifest(registered / "bake", lambda manifest: manifest.update(about))
    assert not bpy.ops.rtgi.export.poll() and said in drawn()[0]
    if "technique" in about:
        bpy.context.scene.rtgi.technique = "vpl"
        assert bpy.ops.rtgi.export.poll()


def test_the_bundle_of_the_last_bake_goes_before_that_of_the_folder_set_now(registered):
    """The folder was changed after the bake: the preview shows what was baked, and so the export takes it."""
    import shutil
    shutil.copytree(registered / "bake", registered / "last")
    bpy.context.scene.rtgi.last_bake.folder = str(registered / "last")
    from rtgi_addon.blender.bundles import exported_bundle
    from rtgi_addon.blender.engine.shown import shown_for
    assert exported_bundle(bpy.context.scene)[0] == registered / "last"
    assert shown_for(bpy.context.scene).field is not None and drawn()[0].startswith("last: ")


def drawn():
    """The texts and the properties and operators of the panel."""
    from panel_layout import Layout
    layout = Layout()
    context = SimpleNamespace(scene=bpy.context.scene, region=SimpleNamespace(width=1000))
    bpy.types.RTGI_PT_export.draw(SimpleNamespace(layout=layout), context)
    return " ".join(layout.texts), layout.shown


def test_the_panel_shows_engine_folder_and_button(registered):
    assert drawn()[1] == ["engine", "part", "folder", "model", "style", "rtgi.export"]


def test_the_style_that_is_on_goes_along_to_engines_that_take_one(registered, monkeypatch):
    from rtgi_addon.blender.ui.export import _style
    scene = bpy.context.scene
    assert _style(scene, "godot") is None
    scene.rtgi_effects.use_effect_stylized, scene.rtgi_effects.effect_stylized.bands = True, 5
    assert _style(scene, "godot").bands == 5 and _style(scene, "threejs").bands == 5
    monkeypatch.setattr(type(engines.get("threejs")), "styles", False)
    assert _style(scene, "threejs") is None
    scene.rtgi_export.style = False
    assert _style(scene, "godot") is None


def test_the_shell_exports_no_other_scenes_bundle(registered, tmp_path):
    edit_manifest(registered / "bake", lambda manifest: manifest.update(scene="Cellar"))
    arguments = build_parser("rtgi").parse_args(["export", str(registered / "bake"), "--engine", "godot", "--out",
                                                 str(tmp_path / "out")])
    with pytest.raises(BakeError, match="is of scene 'Cellar'"):
        SUBCOMMANDS["export"].run(arguments, Session(Progress(), None, True, lambda: None))
    assert not (tmp_path / "out").exists()


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
