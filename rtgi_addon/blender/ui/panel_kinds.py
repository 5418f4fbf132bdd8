"""Where panels stand and how they begin: mixed into every panel of ours, so that alike ones are alike."""

from ...techniques import PRESETS, Technique

# Settings that everybody sets, beside those that presets set; the others are for experts.
_ALWAYS = {"order", "bounces", "direct", "fit"}


def split(layout):
    """``layout`` as Blender's own settings look: labels left, values right, no dots for keyframes."""
    layout.use_property_split, layout.use_property_decorate = True, False
    return layout


class InProperties:
    """Mixed into a panel of the properties editor; ``bl_context`` says where."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"


class InRender(InProperties):
    """Mixed into a panel of Properties › Render."""

    bl_context = "render"


class InData(InProperties):
    """Mixed into a panel of Properties › Data."""

    bl_context = "data"


class InObject(InProperties):
    """Mixed into a panel of Properties › Object."""

    bl_context = "object"


class Closed:
    """Mixed into a panel that is folded until somebody opens it."""

    bl_options = {"DEFAULT_CLOSED"}


class InSidebar:
    """Mixed into a panel of the 3D view's sidebar."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"


class ToolPanel(Closed, InSidebar):
    """Mixed into the panel of a tool, below the bake's."""

    bl_parent_id = "RTGI_PT_bake"


def is_basic(technique: Technique, name: str) -> bool:
    """Whether the setting ``name`` of ``technique`` is one that everybody sets: what presets set, and a few more. Those of a
    technique without presets all are."""
    presets = [technique.presets.get(preset, {}) for preset in PRESETS]
    return not any(presets) or name in _ALWAYS or any(name in preset for preset in presets)
