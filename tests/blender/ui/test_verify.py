"""Verification in the panel: the button, what it compares, and the lines that come out."""

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material, point_cloud  # noqa: E402
from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402


@pytest.fixture
def room(empty_blend, tmp_path, monkeypatch):
    """A registered add-on, and a room with a lamp and a volume of two probes."""
    rtgi_addon.register()
    walls = link("room", cube_mesh(size=2.0))
    walls.data.flip_normals()
    walls.data.materials.append(material("wall", (0.5, 0.5, 0.5)))
    lamp = bpy.data.lights.new("bulb", "POINT")
    lamp.energy = 100.0
    link("bulb", lamp).location = (0, 0, 1.5)
    probes = bpy.data.lightprobes.new("probes", "VOLUME")
    probes.resolution_x, probes.resolution_y, probes.resolution_z = 2, 1, 1
    link("probes", probes)
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    from rtgi_addon.blender.ui import verify as module
    real = module.verify

    def quick(*arguments, **options):
        return real(*arguments, points=8, probes=2, paths=64, most_suspects=3, **options)

    monkeypatch.setattr(module, "verify", quick)
    yield module
    rtgi_addon.unregister()


def draw(module):
    layout = Layout()
    module.RTGI_PT_verify.draw(SimpleNamespace(layout=layout), SimpleNamespace(
        scene=bpy.context.scene, region=SimpleNamespace(width=300)))
    return " ".join(layout.texts), layout.shown


def test_a_scene_that_agrees_is_said_to(room):
    assert draw(room) == ("", ["rtgi.verify"])
    assert bpy.ops.rtgi.verify() == {"FINISHED"}
    report = room.verifications.reports[bpy.context.scene.name]
    assert report.agrees and report.baked is None
    text, shown = draw(room)
    assert "agrees with Cycles within" in text and shown == ["rtgi.verify"]


def test_the_bake_is_compared_while_it_holds(room):
    bpy.context.scene.rtgi.technique_probes.error = 0.05
    bpy.ops.rtgi.bake()
    bpy.ops.rtgi.verify()
    assert room.verifications.reports[bpy.context.scene.name].baked is not None
    from rtgi_addon.blender.session import session
    session.stale[bpy.context.scene.name] = True
    bpy.ops.rtgi.verify()
    assert room.verifications.reports[bpy.context.scene.name].baked is None


def test_who_makes_a_difference_can_be_clicked(room):
    point_cloud("soot", [(x, y, 1.0) for x in range(-1, 2) for y in range(-1, 2)], 0.6, material("black", (0, 0, 0)))
    assert bpy.ops.rtgi.verify() == {"FINISHED"}
    text, shown = draw(room)
    assert "differs from Cycles by" in text and "object soot makes the difference" in text and "measured" in text
    assert shown.count("rtgi.select_named") >= 2
    about = [line for line in room.lines(room.verifications.reports[bpy.context.scene.name]) if line.objects]
    assert {line.objects for line in about} == {("soot",)}


def test_a_reason_against_it_is_reported(room):
    bpy.context.view_layer.material_override = bpy.data.materials["wall"]
    with pytest.raises(RuntimeError, match="overrides all materials"):
        bpy.ops.rtgi.verify()
    bpy.context.view_layer.material_override = None


def test_another_file_forgets_it(room):
    bpy.ops.rtgi.verify()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not room.verifications.reports
