"""The widgets of the stylized effect's ramps, Blender's colour ramp or its curves, for which a hidden node group stands in."""

import bpy
import numpy as np

from ...effects import get
from ...effects.stylized.ramps import format_ramp, parse_ramp
from ...errors import BakeError
from ..styles import STYLIZED
from .effect_settings import settings_of

# Settings of the effect that the widgets show, and the node group that holds those of a scene.
RAMPS, GROUP = ("ramp", "highlight_ramp"), ".RTGI Ramps"
RAMP_NODE, CURVE_NODE = "ShaderNodeValToRGB", "ShaderNodeRGBCurve"
_KEPT_WITHIN = 1e-4
# How far apart a hard step's two points are on a curve.
_STEP = 1e-3


class RTGI_OT_edit_ramp(bpy.types.Operator):
    """Edit the ramp as Blender's color ramp, or as response curves, in place of a line of text"""

    bl_idname = "rtgi.edit_ramp"
    bl_label = "Edit Ramp"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    setting: bpy.props.StringProperty(name="Setting", description="Which of the ramps", options={"HIDDEN", "SKIP_SAVE"})
    curve: bpy.props.BoolProperty(name="Curve", description="Response curves of red, green and blue in place of the color ramp",
                                  options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context):
        """Make the node that holds it, in place of one of the other kind."""
        scene = context.scene
        if scene.rtgi_ramps is None:
            scene.rtgi_ramps = bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
        nodes, kind = scene.rtgi_ramps.nodes, CURVE_NODE if self.curve else RAMP_NODE
        if self.setting in nodes and nodes[self.setting].bl_idname != kind:
            nodes.remove(nodes[self.setting])
        if self.setting not in nodes:
            nodes.new(kind).name = self.setting
        try:
            show_ramp(scene, self.setting)
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


def node_of(scene: bpy.types.Scene, name: str):
    """The node that shows the ramp called ``name``, or None."""
    return None if scene.rtgi_ramps is None else scene.rtgi_ramps.nodes.get(name)


def show_ramp(scene: bpy.types.Scene, name: str) -> None:
    """Let the widget show what the setting ``name`` says, if there is one. Raises UsageError for a text that is no ramp."""
    node = node_of(scene, name)
    if node is None:
        return
    positions, colours, constant = parse_ramp(getattr(settings_of(scene, get(STYLIZED)), name))
    if node.bl_idname == CURVE_NODE:
        _show_curves(node.mapping, positions, colours, constant)
        return
    ramp = node.color_ramp
    ramp.interpolation = "CONSTANT" if constant else "LINEAR"
    while len(ramp.elements) > 1:
        ramp.elements.remove(ramp.elements[-1])
    while len(ramp.elements) < len(positions):
        ramp.elements.new(1.0)
    for element, position, colour in zip(ramp.elements, positions, colours, strict=True):
        element.position, element.color = position, (*colour, 1.0)


def _show_curves(mapping, positions, colours, constant: bool) -> None:
    """Curves of red, green and blue in straight pieces; the combined one is left straight. Hard steps are steep ones."""
    mapping.use_clip, mapping.extend = False, "HORIZONTAL"
    for channel in range(4):
        points = [(0.0, 0.0), (1.0, 1.0)] if channel == 3 else [
            (place, float(colour[channel])) for place, colour in zip(positions, colours, strict=True)]
        if constant and channel < 3:
            before = [(place - _STEP, value) for (place, _), (_, value) in zip(points[1:], points[:-1], strict=True)]
            points = sorted([*points, *before])
        if len(points) == 1:
            points.append((1.0 if points[0][0] < 1.0 else 0.0, points[0][1]))
        curve = mapping.curves[channel]
        while len(curve.points) > 2:
            curve.points.remove(curve.points[-1])
        while len(curve.points) < len(points):
            curve.points.new(1.0, 1.0)
        for point, place in zip(curve.points, sorted(points), strict=True):
            point.location, point.handle_type = place, "VECTOR"
    mapping.update()


def text_of(node) -> str:
    """The ramp of a node as its setting has it. Curved interpolation is followed by stops in between."""
    if node.bl_idname == CURVE_NODE:
        return _text_of_curves(node.mapping)
    ramp = node.color_ramp
    positions = [element.position for element in ramp.elements]
    if ramp.interpolation not in {"CONSTANT", "LINEAR"}:
        positions = sorted({*positions, *(step / 16 for step in range(17))})
    constant = ramp.interpolation == "CONSTANT"
    if constant:
        colours = [tuple(element.color)[:3] for element in ramp.elements]
    else:
        colours = [ramp.evaluate(place)[:3] for place in positions]
    return format_ramp(positions, colours, constant)


def _text_of_curves(mapping) -> str:
    """Red, green and blue after the combined curve, as Blender applies them: the combined one first."""
    mapping.initialize()
    points = [point for curve in mapping.curves for point in curve.points]
    # A combined curve moves where the others' points are met.
    straight = all(point.handle_type == "VECTOR" for point in points) and all(
        abs(point.location[0] - point.location[1]) < _KEPT_WITHIN for point in mapping.curves[3].points)
    places = {round(min(max(point.location[0], 0.0), 1.0), 4) for point in points}
    if straight:
        # Blender's own table has 257 samples and misses corners by some thousandths.
        found = [np.interp(sorted(places), *np.transpose([point.location for point in curve.points])) for curve in mapping.curves]
        return format_ramp(sorted(places), np.maximum(np.transpose(found[:3]), 0.0))
    places = sorted(places | {step / 32 for step in range(33)})
    colours = []
    for place in places:
        combined = mapping.evaluate(mapping.curves[3], place)
        colours.append([max(mapping.evaluate(mapping.curves[channel], combined), 0.0) for channel in range(3)])
    return format_ramp(places, colours)


def draw_ramp(layout, scene: bpy.types.Scene, item) -> None:
    """The setting of a ramp: its widget where it has one, else its text, and buttons for the widgets."""
    node = node_of(scene, item.name)
    row = layout.row(align=True)
    if node is None:
        row.prop(settings_of(scene, get(STYLIZED)), item.name)
    else:
        row.label(text=item.metadata["label"])
    for kind, icon in ((RAMP_NODE, "COLOR"), (CURVE_NODE, "FCURVE")):
        if node is None or node.bl_idname != kind:
            button = row.operator("rtgi.edit_ramp", text="", icon=icon)
            button.setting, button.curve = item.name, kind == CURVE_NODE
    if node is None:
        return
    if node.bl_idname == CURVE_NODE:
        layout.template_curve_mapping(node, "mapping", type="COLOR")
    else:
        layout.template_color_ramp(node, "color_ramp", expand=True)
    # Drawing may not write: what the widget was changed to is written as soon as it is over.
    if not _same_ramp(text_of(node), getattr(settings_of(scene, get(STYLIZED)), item.name)):
        bpy.app.timers.register(lambda name=scene.name, setting=item.name: _take(name, setting), first_interval=0.0)


def _take(scene_name: str, setting: str) -> None:
    scene = bpy.data.scenes.get(scene_name)
    node = None if scene is None else node_of(scene, setting)
    if node is not None:
        setattr(settings_of(scene, get(STYLIZED)), setting, text_of(node))


def _same_ramp(one: str, other: str) -> bool:
    try:
        first, second = parse_ramp(one), parse_ramp(other)
    except BakeError:
        return False
    return first[2] == second[2] and len(first[0]) == len(second[0]) and all(
        abs(a - b) <= _KEPT_WITHIN for a, b in zip((*first[0], *first[1].ravel()), (*second[0], *second[1].ravel()), strict=True))
