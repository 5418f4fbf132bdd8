"""The section Media: what was found is listed, presets set what they say, and what is set arrives at the effect."""

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import numpy as np  # noqa: E402
from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.scene import DensityGrid, Medium, Phase  # noqa: E402
from rtgi_addon.transport.media.summary import found_media  # noqa: E402


@pytest.fixture
def scene(empty_blend):
    rtgi_addon.register()
    yield bpy.context.scene
    rtgi_addon.unregister()


def chosen(scene):
    from rtgi_addon.blender.ui.effect_settings import chosen_effects
    return {entry.effect.name: entry.settings for entry in chosen_effects(scene)}


def fill(scene):
    """A cube of haze."""
    bpy.ops.mesh.primitive_cube_add()
    material = bpy.data.materials.new("Haze")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, medium = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeVolumeScatter")
    medium.inputs["Density"].default_value, medium.inputs["Anisotropy"].default_value = 0.5, 0.25
    medium.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(medium.outputs[0], output.inputs["Volume"])
    bpy.context.object.data.materials.append(material)
    bpy.context.object.name = "Room"


def draw(scene):
    layout = Layout()
    panel = bpy.types.RTGI_PT_media
    panel.draw(SimpleNamespace(layout=layout), SimpleNamespace(scene=scene, region=SimpleNamespace(width=900)))
    return layout


def test_media_in_numbers():
    grid = DensityGrid(np.eye(4), np.float32([[[0.5, 2.0]]]))
    plain, dense, glow = found_media((
        Medium("plain", np.full(3, 0.3), np.full(3, 0.1), phase=Phase(anisotropy=0.4)),
        Medium("dense", np.full(3, 1.0), grid=grid), Medium("glow", emission=np.ones(3))))
    assert (plain.mean_free_path, plain.albedo, plain.g) == pytest.approx((2.5, 0.75, 0.4)) and not plain.varies
    assert dense.mean_free_path == pytest.approx(0.5) and dense.varies and dense.albedo == 1.0
    assert glow.mean_free_path == float("inf") and glow.glows and glow.albedo == 0.0


def test_what_was_found_is_listed(scene):
    assert "rtgi.check" in draw(scene).shown
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.rtgi.check()
    assert any("No fog" in text for text in draw(scene).texts)
    fill(scene)
    bpy.ops.rtgi.check()
    shown = draw(scene)
    assert "Room: mean free path 2 m, albedo 1.00, g 0.25" in shown.texts and "rtgi.check" not in shown.shown
    assert {"tile", "slices", "reach", "orders", "steady"} <= set(shown.shown)


def test_the_rest_of_many_media_is_counted(scene):
    from rtgi_addon.blender.session import session
    session.media[scene.name] = found_media(tuple(Medium(f"fog {number}", np.ones(3)) for number in range(11)))
    texts = draw(scene).texts
    assert "and 3 more" in texts and sum("mean free path" in text for text in texts) == 8
    head = Layout()
    bpy.types.RTGI_PT_media.draw_header(SimpleNamespace(layout=head), SimpleNamespace(scene=scene))
    assert head.shown == ["use_effect_media"]


@pytest.mark.parametrize("name,tile,slices", [("Draft", 16, 32), ("Preview", 8, 64), ("Final", 3, 96)])
def test_a_preset_sets_what_it_says(scene, name, tile, slices):
    assert chosen(scene)["media"].tile == 8
    assert bpy.ops.rtgi.apply_media_preset(filepath=bpy.utils.preset_find(name, "rtgi_media")) == {"FINISHED"}
    assert (chosen(scene)["media"].tile, chosen(scene)["media"].slices) == (tile, slices)
    assert str(tile) in rtgi_addon.blender.ui.media.TOOLTIPS[name.lower()]


def test_blender_is_told_every_setting_to_keep(scene):
    from dataclasses import fields

    from rtgi_addon.blender.ui.media import RTGI_OT_add_media_preset
    from rtgi_addon.effects import get
    kept = RTGI_OT_add_media_preset.preset_values.fget(None)
    assert {f"media.{item.name}" for item in fields(get("media").Settings)} <= set(kept) and "media.use_reach" in kept
    assert all(hasattr(scene.rtgi_effects.effect_media, path.removeprefix("media.")) for path in kept)
