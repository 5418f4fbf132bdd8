"""What engines have of the effect `stylized` in common: its values as uniforms, its ramps as a picture, one text of GLSL for bands
and grading, and a still life to hold their lines to.
"""

from pathlib import Path

import numpy as np

from ...effects import Frame, get
from ...effects.lit import light_context
from ...effects.stylized.edges import find_borders
from ...effects.stylized.ramps import ramp_table
from ...effects.stylized.settings import NORMAL_EDGES, SHADINGS, StylizedSettings
from ...effects.stylized.strokes import draw_lines
from ...scene import Instance, Material, Mesh, Scene
from ...storage.png import write_png
from ...transport.views.camera import CameraView
from ...transport.views.gbuffer import draw_gbuffer
from .axes import Axes

# The picture of ramps beside the index: row 0 for light, row 1 for highlights, both over the scale, in 8 bits of sRGB.
RAMPS = "style_ramps.png"
# The picture that engines are held to, and its camera: half the picture's height at the distance 1, near and far plane [m].
SIZE, _LENS, _NEAR, _FAR = (160, 120), 1.6, 0.05, 100.0
# What the picture is drawn with: lines alone, by what engines know.
DRAWN = StylizedSettings(shading="paper", paper_color=(1.0, 1.0, 1.0), paper_background=True, depth_edges="inverse_depth",
                         object_edges=True, material_edges=False, line_width=2.0)


def style_functions() -> str:
    """GLSL of bands, ramps and grading over uniforms ``style_NAME``, the same in every engine."""
    return Path(__file__).with_name("style.glsl").read_text(encoding="utf-8")


def style_values(settings: StylizedSettings) -> dict:
    """The uniforms ``style_NAME`` that ``style_functions`` and passes over the screen have in every engine, by NAME."""
    return {"shading": SHADINGS.index(settings.shading), "bands": settings.bands, "per_channel": settings.per_channel,
            "softness": settings.softness, "key": settings.key, "ramp_scale": ramp_scale(settings), "ramp_tint": settings.ramp_tint,
            "shadow_color": settings.shadow_color, "shadow_amount": settings.shadow_amount, "bleeding": settings.bleeding,
            "paper_color": settings.paper_color, "paper_background": settings.paper_background, "contrast": settings.contrast,
            "saturation": settings.saturation, "tint": settings.tint, "lines": settings.lines,
            "depth_threshold": settings.depth_threshold if settings.depth_edges != "none" else 1e20,
            "creases": settings.normal_edges != NORMAL_EDGES[-1], "crease_cosine": float(np.cos(np.radians(settings.crease_angle))),
            "contours": settings.object_edges, "line_width": settings.line_width, "line_thinning": settings.line_thinning or 0.0,
            "line_least": settings.line_least, "line_color": settings.line_color, "line_opacity": settings.line_opacity}


def ramp_scale(settings: StylizedSettings) -> float:
    """What white in the picture of ramps stands for."""
    return max(1.0, *(float(ramp_table(text).max()) for text in (settings.ramp, settings.highlight_ramp)))


def write_ramps(path: Path, settings: StylizedSettings) -> None:
    """Write the ramps of ``settings`` as a PNG. Raises BakeError for a disk that refuses."""
    linear = np.stack([ramp_table(settings.ramp), ramp_table(settings.highlight_ramp)]) / ramp_scale(settings)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
    write_png(path, np.round(255 * encoded).astype(np.uint8))


def lost_everywhere(settings: StylizedSettings) -> list[str]:
    """What no engine has of a style."""
    return [what for what, there in (
        ("marked edges", settings.marked_edges), ("dots and strokes", settings.pattern != "none"),
        ("colours of lines by material", settings.line_by_material), ("widths in the world", settings.line_world_width is not None),
        ("lines along curvature", settings.curvature_edges != "none"),
        ("exclusions from lines", bool(settings.exclude_pass_index or settings.exclude_collection))) if there]


def picture(axes: Axes, apart: bool) -> dict:
    """A still life of four boxes, one object or ``apart``, in the engine's axes; its camera, and the coverage of lines that numpy
    draws (rows from the top) in 255ths."""
    scene, view, coverage = still_life(apart)
    pose = view.world_from_camera
    camera = {name: axes.vectors(pose[:3, column]).tolist() for column, name in enumerate(("x", "y", "z", "origin"))}
    return {"size": SIZE, "objects": len(scene.meshes),
            "triangles": axes.vectors(np.concatenate([mesh.vertices_local[mesh.triangles].reshape(-1, 3) for mesh in scene.meshes])
                                      ).ravel().tolist(),
            "camera": {**camera, "fov": float(np.degrees(2 * np.arctan(1 / _LENS))), "near": _NEAR, "far": _FAR},
            "coverage": np.round(255 * np.flipud(coverage)).astype(int).ravel().tolist()}


def still_life(apart: bool) -> tuple[Scene, CameraView, np.ndarray]:
    """The scene of ``picture``, its view, and the coverage of lines (h, w), row 0 at the bottom."""
    scene, view = _boxes(apart), _view()
    context = light_context(scene, 1)
    nothing = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    frame = Frame(scene, view, draw_gbuffer(context, view, SIZE), nothing, nothing, nothing)
    values = get("stylized").parameters(DRAWN, scene)
    return scene, view, draw_lines(find_borders(frame, values), values["line_widest"]).coverage


def _view() -> CameraView:
    back = np.array([1.6, -3.0, 1.7]) / np.linalg.norm([1.6, -3.0, 1.7])
    right = np.cross([0, 0, 1.0], back) / np.linalg.norm(np.cross([0, 0, 1.0], back))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([right, np.cross(back, right), back], axis=1), 4.0 * back + (0.2, 0.0, 0.4)
    clip = np.array([[_LENS * SIZE[1] / SIZE[0], 0, 0, 0], [0, _LENS, 0, 0],
                     [0, 0, -(_FAR + _NEAR) / (_FAR - _NEAR), -2 * _FAR * _NEAR / (_FAR - _NEAR)], [0, 0, -1, 0]])
    return CameraView(pose, clip)


def _boxes(apart: bool) -> Scene:
    """A table, two boxes and a plate that hangs before one of them."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64)
    sides = np.array([[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2],
                      [1, 3, 7], [1, 7, 5]], np.int32)
    boxes = (((-1.6, -1.2, -0.1), (1.6, 1.4, 0.0)), ((-0.9, -0.2, 0.0), (0.1, 0.8, 0.9)), ((0.5, 0.1, 0.0), (1.0, 0.6, 1.4)),
             ((-0.5, -0.9, 0.2), (0.2, -0.86, 0.7)))
    vertices = [np.array(low) + corners * (np.array(high) - np.array(low)) for low, high in boxes]
    if not apart:
        sides, vertices = np.concatenate([sides + 8 * number for number in range(len(boxes))]), [np.concatenate(vertices)]
    meshes = tuple(Mesh("still life", place.astype(np.float32), sides, np.zeros(len(sides), np.int32)) for place in vertices)
    return Scene("still life", meshes, tuple(Instance("still life", number, np.eye(4)) for number in range(len(meshes))),
                 (Material("grey"),))
