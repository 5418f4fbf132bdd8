"""Effects in the panel: a switch and settings for each, made from its Settings, off but for what belongs to the scene."""

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.effects import Chosen, registry  # noqa: E402
from rtgi_addon.errors import UsageError  # noqa: E402

MIST = registry()["mist"]


@pytest.fixture
def scene(empty_blend):
    rtgi_addon.register()
    yield bpy.context.scene
    rtgi_addon.unregister()


def chosen(scene):
    from rtgi_addon.blender.ui.effect_settings import chosen_effects
    return chosen_effects(scene)


def test_none_is_on_until_it_is_switched_on(scene):
    from rtgi_addon.blender.ui.effect_settings import switch
    assert [entry.effect.name for entry in chosen(scene)] == ["media"]
    scene.rtgi_effects.use_effect_media = False
    assert chosen(scene) == ()
    for name, effect in registry().items():
        setattr(scene.rtgi_effects, switch(name), True)
        # As the panel has it by default is as the effect has it by default.
        assert Chosen(effect, effect.Settings()) in chosen(scene)
    assert [entry.effect.name for entry in chosen(scene)] == list(registry())


def test_what_is_set_arrives_in_its_type(scene):
    scene.rtgi_effects.use_effect_mist, group = True, scene.rtgi_effects.effect_mist
    scene.rtgi_effects.use_effect_media = False
    group.fade_to, group.color, group.use_start, group.start, group.falloff = "color", (0.1, 0.2, 0.3), True, 2.5, "linear"
    assert chosen(scene) == (Chosen(MIST, MIST.Settings("color", (0.1, 0.2, 0.3), 1.0, 2.5, None, "linear")),)
    group["color"] = (-1.0, 0.0, 0.0)
    if group.color[0] < 0:
        with pytest.raises(UsageError, match="color"):
            chosen(scene)


@pytest.mark.parametrize("name", list(registry()))
def test_every_panel_can_be_drawn(scene, name):
    from dataclasses import fields

    from rtgi_addon.blender.ui.effect_panels import RTGI_PT_effects
    from rtgi_addon.blender.ui.effect_settings import switch
    panel = getattr(bpy.types, f"RTGI_PT_{switch(name)}")
    assert panel.bl_parent_id == RTGI_PT_effects.bl_idname and panel.bl_label == registry()[name].label
    context, head, body = SimpleNamespace(scene=scene), Layout(), Layout()
    setattr(scene.rtgi_effects, switch(name), False)
    panel.draw_header(SimpleNamespace(layout=head, effect=panel.effect), context)
    parts = [getattr(bpy.types, f"{panel.__name__}_{number}") for number in range(len(registry()[name].sections))]
    for part in (panel, *parts):
        assert part is panel or part.bl_parent_id == panel.bl_idname
        part.draw(SimpleNamespace(layout=body, effect=part.effect, shown=part.shown), context)
    assert head.shown == [switch(name)] and {item.name for item in fields(registry()[name].Settings)} <= set(body.shown)
    assert body.active is False
    assert panel.poll(SimpleNamespace(engine="RTGI")) and not panel.poll(SimpleNamespace(engine="CYCLES"))
    RTGI_PT_effects.draw(SimpleNamespace(layout=Layout()), context)


def test_settings_stay_with_the_file_when_the_add_on_goes_and_comes(scene):
    scene.rtgi_effects.use_effect_mist = True
    rtgi_addon.unregister()
    assert not hasattr(bpy.types.Scene, "rtgi_effects")
    rtgi_addon.register()
    assert bpy.context.scene.rtgi_effects.use_effect_mist
