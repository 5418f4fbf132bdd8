"""Placement in the panel: scattered probes shown as Empties, edited, and baked."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.exchange.bundle import read_bundle  # noqa: E402

COLLECTION = "Scattered Probes"


@pytest.fixture
def room(empty_blend, tmp_path):
    """A room with a lamp and a volume, whose probes are to be scattered."""
    rtgi_addon.register()
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.5, 1.0))
    bpy.ops.object.lightprobe_add(type="VOLUME")
    volume = bpy.context.object
    volume.scale = 1.9, 1.9, 1.9
    volume.data.resolution_x = volume.data.resolution_y = volume.data.resolution_z = 4
    scene.rtgi.technique, scene.rtgi.output = "probes", str(tmp_path / "bake")
    scene.rtgi.technique_probes.error, scene.rtgi.technique_probes.max_rays = 0.1, 256
    scene.rtgi.scatter.placement = "scattered"
    bpy.context.view_layer.update()
    yield scene
    rtgi_addon.unregister()


def places(grid):
    return grid.volume.scattered.points_world


def test_probes_are_shown_moved_and_baked(room):
    assert bpy.ops.rtgi.place_probes() == {"FINISHED"}
    shown = bpy.data.collections[COLLECTION].objects
    assert 1 < len(shown) < 64 and all(obj.type == "EMPTY" for obj in shown)
    for obj in shown[2:]:
        bpy.data.objects.remove(obj)
    shown[0].location = 0.3, -0.2, 0.1
    bpy.context.view_layer.update()
    room.rtgi.scatter.points, room.rtgi.scatter.add = COLLECTION, False
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    found = places(read_bundle(room.rtgi.output).grids[0])
    expected = np.array([obj.location for obj in shown])
    assert np.allclose(np.sort(found, axis=0), np.sort(expected, axis=0), atol=1e-4)


def test_showing_again_replaces_what_was_shown(room):
    bpy.ops.rtgi.place_probes()
    count = len(bpy.data.collections[COLLECTION].objects)
    room.rtgi.scatter.points = COLLECTION
    bpy.ops.rtgi.place_probes()
    assert len(bpy.data.collections[COLLECTION].objects) == count


def test_a_collection_without_empties_is_refused_by_name(room):
    room.rtgi.scatter.points = "Nobody"
    with pytest.raises(RuntimeError, match="'Nobody' has no Empties"):
        bpy.ops.rtgi.bake()


def test_the_panel_shows_how_probes_are_scattered_where_they_are(room):
    from rtgi_addon.blender.ui.placement import RTGI_PT_render_placement
    for placement, shown in (("lattice", ["placement"]), ("scattered", ["placement", "error", "points", "add", "rays",
                                                                        "rtgi.place_probes"])):
        room.rtgi.scatter.placement, layout = placement, Layout()
        RTGI_PT_render_placement.draw(SimpleNamespace(layout=layout),
                                      SimpleNamespace(scene=room, region=SimpleNamespace(width=400)))
        assert layout.shown == shown
