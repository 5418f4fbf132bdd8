"""Which scene, view layer and frame of a file a command reads."""

import argparse
from dataclasses import replace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import scene_builders as build  # noqa: E402
from blend_builders import cube_mesh, link  # noqa: E402

from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser  # noqa: E402
from rtgi_addon.blender.cli.part import accepted, choose_part  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import UsageError  # noqa: E402
from rtgi_addon.scene import Omission  # noqa: E402


def arguments(*words, subcommand="plan"):
    return build_parser("rtgi").parse_args([subcommand, *words])


@pytest.fixture
def two_scenes(empty_blend):
    """Scene 'Hall' with a cube that moves and, in its view layer 'Half', one less; scene 'Shed' with a cube of its own."""
    hall = bpy.context.scene
    hall.name = "Hall"
    moving = link("moving", cube_mesh())
    for frame, height in ((1, 0.0), (11, 10.0)):
        moving.location.z = height
        moving.keyframe_insert("location", frame=frame)
    curves = moving.animation_data.action.layers[0].strips[0].channelbags[0].fcurves if bpy.app.version >= (4, 4) else \
        moving.animation_data.action.fcurves
    for curve in curves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    extra = bpy.data.collections.new("extra")
    hall.collection.children.link(extra)
    link("extra cube", cube_mesh(), collection=extra)
    hall.view_layers.new("Half").layer_collection.children["extra"].exclude = True
    link("shed cube", cube_mesh(), collection=bpy.data.scenes.new("Shed").collection)


def names():
    return {instance.name for instance in extract_scene().instances}


def test_a_scene_is_chosen_by_name(two_scenes):
    choose_part(arguments())
    assert names() == {"moving", "extra cube"}
    choose_part(arguments("--scene", "Shed"))
    assert extract_scene().name == "Shed" and names() == {"shed cube"}


def test_a_view_layer_is_chosen_by_name(two_scenes):
    choose_part(arguments("--view-layer", "Half"))
    assert names() == {"moving"}
    choose_part(arguments("--scene", "Hall", "--view-layer", "ViewLayer"))
    assert names() == {"moving", "extra cube"}


@pytest.mark.parametrize(("frame", "height"), [("1", 0.0), ("6", 5.0), ("3.5", 2.5), ("-2", 0.0)])
def test_a_frame_is_chosen_by_number(two_scenes, frame, height):
    choose_part(arguments("--frame", frame))
    moved, = [instance for instance in extract_scene().instances if instance.name == "moving"]
    assert moved.world_from_local[2, 3] == pytest.approx(height, abs=1e-4)


@pytest.mark.parametrize("words", [("--scene", "Barn"), ("--view-layer", "Quarter"), ("--scene", "Shed", "--view-layer", "Half")])
def test_unknown_names_are_refused_with_the_known_ones(two_scenes, words):
    with pytest.raises(UsageError, match=r"unknown .*choose one of"):
        choose_part(arguments(*words))


@pytest.fixture
def known():
    """The properties, as a shell has them."""
    from rtgi_addon.blender.cli.open_file import known_properties
    with known_properties():
        yield


def test_objects_and_lamps_get_roles_by_name(known, two_scenes):
    data = bpy.data.lights.new("bulb", "POINT")
    for name in ("a=b", "other"):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    choose_part(arguments("--object", "moving=dynamic", "--object", "extra cube=none", "--lamp", "a=b=all"))
    scene = extract_scene()
    assert [(instance.name, instance.bake) for instance in scene.instances] == [("moving", "DYNAMIC")]
    # Of lamps that share their data the other stays as it is.
    assert {light.name: light.bake for light in scene.lights} == {"a=b": "ALL", "other": "BOUNCES"}


@pytest.mark.parametrize(("words", "message"), [
    (("--object", "wall=static"), "unknown object 'wall'"), (("--lamp", "moving=all"), "unknown lamp 'moving'"),
    (("--lamp", "moving=dark"), "is not NAME=all"), (("--object", "moving"), "is not NAME=static")])
def test_unknown_names_and_roles_are_refused(known, two_scenes, words, message):
    with pytest.raises(UsageError, match=message):
        choose_part(arguments(*words))


def test_every_command_that_reads_a_file_has_them():
    for name, entry in SUBCOMMANDS.items():
        parser = argparse.ArgumentParser()
        entry.add_arguments(parser)
        words = ["--out", "x"] if any("--out" in action.option_strings for action in parser._actions) else []
        words += ["bundle"] if any(not action.option_strings for action in parser._actions if action.required) else []
        words += ["--engine", "godot"] if name == "export" else []
        if entry.takes_scene:
            read = arguments(*words, "--frame", "2", "--scene", "a", "--view-layer", "b", "--enable-scripts", subcommand=name)
            assert (read.frame, read.scene, read.view_layer, read.enable_scripts) == (2.0, "a", "b", True)
            assert not arguments(*words, subcommand=name).enable_scripts
        else:
            with pytest.raises(UsageError):
                arguments(*words, "--view-layer", "b", subcommand=name)


def test_a_frame_is_a_number():
    with pytest.raises(UsageError):
        arguments("--frame", "nan")


def test_what_is_missing_can_be_accepted():
    scene = replace(build.scene([build.cube()]), omissions=(Omission("gone", remedy="bring it back"),))
    assert accepted(scene, arguments()) is scene
    kept, = accepted(scene, arguments("--accept-missing")).omissions
    assert (kept.text, kept.remedy) == ("gone", "")
