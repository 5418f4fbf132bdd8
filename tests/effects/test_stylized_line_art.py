"""Lines against Blender's own Line Art through the same camera: nearly all of either are within a pixel of the other's."""

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from line_art import border_points, line_art, near_ones  # noqa: E402
from mathutils import Vector  # noqa: E402

from rtgi_addon.effects import get  # noqa: E402
from rtgi_addon.effects.lit import light_context  # noqa: E402
from rtgi_addon.effects.stylized.edges import find_borders  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402
from rtgi_addon.transport.views.gbuffer import draw_gbuffer  # noqa: E402

SAMPLES = Path(__file__).resolve().parents[2] / "sample_blends"
SIZE = 480, 270
STYLE = get("stylized")


def camera(location, target):
    bpy.ops.object.camera_add(location=location)
    bpy.context.object.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = bpy.context.object


def head():
    bpy.ops.mesh.primitive_monkey_add(size=2, rotation=(0.2, 0, 0.5))
    bpy.context.object.modifiers.new("subdivision", "SUBSURF").render_levels = 3
    bpy.context.object.modifiers[0].levels = 3
    bpy.ops.object.shade_smooth()
    camera((0, -6, 1.5), (0, 0, 0))


def solids():
    bpy.ops.mesh.primitive_plane_add(size=14)
    bpy.ops.mesh.primitive_cube_add(size=1.6, location=(-1.4, 0, 0.8), rotation=(0, 0, 0.5))
    bpy.ops.mesh.primitive_torus_add(major_segments=96, minor_segments=48, location=(1.1, -0.4, 0.7), rotation=(0.9, 0.3, 0))
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.9, location=(0.2, 1.8, 0.9))
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=0.8, depth=1.6, location=(2.8, 1.4, 0.8))
    camera((1.0, -7, 3.2), (0.4, 0.4, 0.6))


def street():
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / "toon_street.blend"))


SCENES = {"head": head, "solids": solids, "street": street}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_lines_are_where_line_art_has_them(empty_blend, name):
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.effects import Frame
    SCENES[name]()
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = SIZE
    bpy.context.scene.render.resolution_percentage = 100
    scene = extract_scene()
    view, context = CameraView.of(scene.cameras[0]), light_context(scene)
    nothing = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    frame = Frame(scene, view, draw_gbuffer(context, view, SIZE), nothing, nothing, nothing)
    expected = line_art(view, SIZE)
    found = border_points(find_borders(frame, STYLE.parameters(STYLE.Settings(), scene)))
    precision, recall = near_ones(found, expected, 1.0), near_ones(expected, found, 1.0)
    # Measured: head 0.976 and 0.972, solids 1.000 and 0.999, street 0.999 and 0.998.
    assert precision.mean() >= 0.95 and recall.mean() >= 0.95
