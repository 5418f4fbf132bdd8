"""Finding leaks from the panel: the operator, what the panel says, and what is forgotten when."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402


@pytest.fixture
def scene(empty_blend, tmp_path):
    """The add-on in a closed room with a lamp and a small lattice."""
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.0, 0.5))
    bpy.context.object.data.energy = 100
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.scale = (2, 2, 2)
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
    scene = bpy.context.scene
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(tmp_path / "bake"), "RAYS", 64
    yield scene
    rtgi_addon.unregister()


def panel(scene):
    from rtgi_addon.blender.ui.leaks import RTGI_PT_leaks
    layout = Layout()
    RTGI_PT_leaks.draw(SimpleNamespace(layout=layout), SimpleNamespace(scene=scene, region=SimpleNamespace(width=400)))
    return " ".join(layout.texts), layout.shown


def test_without_a_bake_there_is_nothing_to_compare(scene):
    assert not bpy.ops.rtgi.find_leaks.poll()
    assert panel(scene) == ("", ["points", "rtgi.find_leaks"])


def test_what_was_found_is_in_the_panel_until_the_next_file(scene):
    from rtgi_addon.blender.session import session
    from rtgi_addon.blender.ui.leaks import leaks
    bpy.ops.rtgi.bake()
    assert bpy.ops.rtgi.find_leaks(points=64) == {"FINISHED"}
    field = session.baked[scene.name, "probes"].field
    found = leaks.of(scene, field)
    assert len(found.cause) == 64 and leaks.of(scene, None) is None
    text, shown = panel(scene)
    assert found.lines()[0] in text and "leaks" in shown and "earlier bake" not in text
    scene.cursor.location = found.receivers.points[3]
    assert "At the 3D cursor" in panel(scene)[0]
    # Another bake has others.
    bpy.ops.rtgi.bake()
    assert "earlier bake" in panel(scene)[0] and leaks.of(scene, session.baked[scene.name, "probes"].field) is None
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not leaks.found


def test_a_receiver_in_words():
    from rtgi_addon.blender.ui.leaks import at_receiver
    from rtgi_addon.evaluate.leaks import Cause
    found = SimpleNamespace(cause=np.int8([Cause.NONE, Cause.THIN_WALL]), error=np.float32([-0.25, 1.5]))
    assert at_receiver(found, 0) == "-25%"
    assert at_receiver(found, 1) == "+150%, wall thinner than the spacing"


def test_errors_have_colours():
    from rtgi_addon.blender.engine.layer import leak_discs
    receivers = SimpleNamespace(points=np.zeros((3, 3), np.float32), normals=np.tile(np.float32([0, 0, 1]), (3, 1)))
    discs = leak_discs(SimpleNamespace(error=np.float32([-1.0, 0.0, 1.0]), receivers=receivers, radius=0.1))
    dark, right, bright = discs.colors
    assert dark[2] > dark[0] and bright[0] > bright[2] and right[:3].min() > 0.8
    assert right[3] < 0.2 < dark[3] and dark[3] == bright[3]
