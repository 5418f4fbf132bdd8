"""Styles as presets: those of the product hold what its table says, the user's own are kept, read and removed; ramps as widgets."""

import importlib.util
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.effects import get, validate_settings  # noqa: E402
from rtgi_addon.effects.stylized.presets import STYLES  # noqa: E402
from rtgi_addon.errors import UsageError  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
EFFECT = get("stylized")


@pytest.fixture
def scene(empty_blend):
    from rtgi_addon.blender.ui.styles import RTGI_PT_styles
    rtgi_addon.register()
    label = RTGI_PT_styles.bl_label
    yield bpy.context.scene
    RTGI_PT_styles.bl_label = label
    rtgi_addon.unregister()


def chosen(scene):
    from rtgi_addon.blender.ui.effect_settings import chosen_effects
    scene.rtgi_effects.use_effect_stylized = True
    return next(entry.settings for entry in chosen_effects(scene) if entry.effect is EFFECT)


def test_the_files_are_those_that_the_tool_writes():
    spec = importlib.util.spec_from_file_location("style_presets", ROOT / "tools" / "style_presets.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert {path.name: path.read_text() for path in tool.PLACE.glob("*.py")} == tool.files(), "run tools/style_presets.py"


@pytest.mark.parametrize("name", STYLES)
def test_a_style_is_applied_whole_in_the_panel_as_on_the_command_line(scene, name):
    from rtgi_addon.blender.styles import style_settings
    expected = EFFECT.Settings(**STYLES[name])
    validate_settings(expected)
    group = scene.rtgi_effects.effect_stylized
    group.use_line_world_width, group.line_width, group.rim_strength = True, 7.0, 3.0
    file = bpy.utils.preset_find(name.replace("_", " ").capitalize(), "rtgi_style")
    assert bpy.ops.rtgi.apply_style(filepath=file) == {"FINISHED"}
    assert chosen(scene) == expected
    assert EFFECT.Settings(**style_settings(name.replace("_", " ").title())) == expected


def test_a_style_of_ones_own_is_kept_found_by_its_name_and_removed(scene, tmp_path, monkeypatch):
    from rtgi_addon.blender.styles import read_style, style_settings
    group = scene.rtgi_effects.effect_stylized
    group.bands, group.use_line_thinning, group.line_thinning, group.tint = 7, True, 12.5, (0.5, 0.25, 1.0)
    values = chosen(scene)
    assert read_style("style.bands = 7\nstyle.use_line_thinning = False\nstyle.line_thinning = 3.0\nprint(1)") == {
        "bands": 7, "line_thinning": None}
    (tmp_path / "mine.py").write_text("style.bands = 7\nstyle.tint = [0.5, 0.25, 1.0]\n")
    monkeypatch.setattr(bpy.utils, "preset_paths", lambda _folder: [str(tmp_path)])
    assert EFFECT.Settings(**style_settings("Mine")) == EFFECT.Settings(bands=7, tint=(0.5, 0.25, 1.0))
    assert values.bands == 7 and values.line_thinning == 12.5
    with pytest.raises(UsageError, match=r"unknown style 'x': choose one of cel, .*mine"):
        style_settings("x")


def test_blender_is_told_every_setting_to_keep(scene):
    from dataclasses import fields

    from rtgi_addon.blender.ui.styles import RTGI_OT_add_style
    kept = RTGI_OT_add_style.preset_values.fget(None)
    assert {f"style.{item.name}" for item in fields(EFFECT.Settings)} <= set(kept)
    assert "style.use_line_thinning" in kept
    group = scene.rtgi_effects.effect_stylized
    assert all(hasattr(group, path.removeprefix("style.")) for path in kept)


def test_blenders_color_ramp_stands_for_the_text(scene):
    from dataclasses import fields

    from rtgi_addon.blender.ui import ramps
    item = next(item for item in fields(EFFECT.Settings) if item.name == "ramp")
    group = scene.rtgi_effects.effect_stylized
    group.ramp = "constant 0:0.1,0.2,0.3 0.5:1,0.5,0"
    layout = Layout()
    ramps.draw_ramp(layout, scene, item)
    assert layout.shown == ["ramp", "rtgi.edit_ramp", "rtgi.edit_ramp"]
    assert bpy.ops.rtgi.edit_ramp(setting="ramp") == {"FINISHED"}
    node = ramps.node_of(scene, "ramp")
    assert ramps._same_ramp(ramps.text_of(node), group.ramp) and len(node.color_ramp.elements) == 2
    node.color_ramp.interpolation = "LINEAR"
    node.color_ramp.elements[1].color = (0.25, 0.5, 0.75, 1.0)
    assert not ramps._same_ramp(ramps.text_of(node), group.ramp)
    ramps._take(scene.name, "ramp")
    assert group.ramp == "0:0.1,0.2,0.3 0.5:0.25,0.5,0.75"
    node.color_ramp.interpolation = "EASE"
    assert len(ramps.text_of(node).split()) > 8
    # A preset's ramp is shown by the widget as well.
    bpy.ops.rtgi.apply_style(filepath=bpy.utils.preset_find("Ink and wash", "rtgi_style"))
    assert ramps._same_ramp(ramps.text_of(node), STYLES["ink_and_wash"]["ramp"])
    group.ramp = "no ramp"
    with pytest.raises(RuntimeError, match="no stop of a ramp"):
        bpy.ops.rtgi.edit_ramp(setting="ramp")


def test_blenders_curves_stand_for_the_text(scene):
    import numpy as np

    from rtgi_addon.blender.ui import ramps
    from rtgi_addon.effects.stylized.ramps import ramp_table
    group = scene.rtgi_effects.effect_stylized
    group.ramp = STYLES["ink_and_wash"]["ramp"]
    assert bpy.ops.rtgi.edit_ramp(setting="ramp") == {"FINISHED"}
    assert bpy.ops.rtgi.edit_ramp(setting="ramp", curve=True) == {"FINISHED"}
    node = ramps.node_of(scene, "ramp")
    assert node.bl_idname == ramps.CURVE_NODE and len(scene.rtgi_ramps.nodes) == 1
    # Beyond 1, too, and to and fro without a change.
    assert ramps._same_ramp(ramps.text_of(node), group.ramp)
    # A curve for red alone, and one for all: values are Blender's own.
    node.mapping.curves[0].points[2].location = 0.3, 0.2
    node.mapping.curves[3].points.new(0.5, 0.25)
    for point in node.mapping.curves[3].points:
        point.handle_type = "AUTO"
    node.mapping.update()
    assert not ramps._same_ramp(ramps.text_of(node), group.ramp)
    ramps._take(scene.name, "ramp")
    table, mapping = ramp_table(group.ramp), node.mapping
    for place in (0.0, 0.21, 0.5, 0.77, 1.0):
        combined = mapping.evaluate(mapping.curves[3], place)
        expected = [mapping.evaluate(mapping.curves[channel], combined) for channel in range(3)]
        found = [np.interp(place, np.linspace(0, 1, 64), table[:, channel]) for channel in range(3)]
        assert np.abs(np.array(found) - expected).max() < 0.03
    # Hard steps are steep ones, and one stop is a level.
    group.ramp = "constant 0:0.1,0.2,0.3 0.5:1,0.5,0"
    bpy.ops.rtgi.edit_ramp(setting="ramp", curve=True)
    steps = ramp_table(ramps.text_of(node))
    assert np.abs(steps - ramp_table(group.ramp)).max() < 0.01 or np.count_nonzero(
        np.abs(steps - ramp_table(group.ramp)).max(axis=1) > 0.01) == 1
    group.ramp = "0.5:0.25"
    bpy.ops.rtgi.edit_ramp(setting="ramp", curve=True)
    assert np.allclose(ramp_table(ramps.text_of(node)), 0.25, atol=1e-4)
