"""Every operator, panel and property of ours has a label and says what it is for."""

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import interface_strings as harvest  # noqa: E402

import rtgi_addon  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def registered():
    rtgi_addon.register()
    yield
    rtgi_addon.unregister()


def test_the_walk_meets_all_that_is_registered():
    names = {cls.__name__ for cls in harvest.classes()}
    assert {"RTGI_OT_bake", "RTGI_OT_chart", "RTGI_PT_render", "RTGI_PT_presets", "RTGI_PG_scene", "RTGI_PG_preview",
            "RTGI_PG_technique_probes", "RTGI_PG_technique_lpv_overrides", "RTGI_RenderEngine"} <= names
    operators = {f"RTGI_OT_{name}" for name in dir(bpy.ops.rtgi)}
    assert operators == {name for name in names if name.startswith("RTGI_OT_")}


def test_every_class_has_a_label_and_says_what_it_is_for():
    for cls in harvest.classes():
        if issubclass(cls, bpy.types.Operator):
            rna = harvest.rna_of(cls)
            assert rna.name and len(rna.description) > 10, cls
            assert not rna.description.endswith("."), f"{cls.__name__}: Blender writes tooltips without a full stop"
        elif issubclass(cls, (bpy.types.Panel, bpy.types.RenderEngine)):
            assert cls.bl_label and cls.__doc__, cls


def test_every_property_has_a_label_and_a_tooltip():
    seen = 0
    for cls in harvest.classes():
        for item in harvest.own_properties(cls):
            where = f"{cls.__name__}.{item.identifier}"
            assert item.name and item.name != item.identifier, f"{where} has no label"
            assert len(item.description) > 3, f"{where} has no tooltip"
            assert not item.description.endswith("."), f"{where}: Blender writes tooltips without a full stop"
            assert item.description != item.name, where
            for entry in harvest.enum_items(item):
                assert entry.name and entry.description, f"{where}: {entry.identifier}"
            seen += 1
    assert seen > 150


def test_what_hangs_on_blenders_own_types_says_what_it_is():
    for owner, name in ((bpy.types.Scene, "rtgi"), (bpy.types.Scene, "rtgi_preview"), (bpy.types.LightProbe, "rtgi"),
                        (bpy.types.ViewLayer, "rtgi")):
        item = owner.bl_rna.properties[name]
        assert item.name and item.description, (owner, name)
