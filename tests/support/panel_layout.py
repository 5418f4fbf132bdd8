"""A layout for panels to draw on, that holds each call against what Blender has registered."""

import bpy

ICONS = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())


class Layout:
    """Takes what a panel draws as ``UILayout`` would: ``texts`` and ``shown`` properties and operators, over all sub-layouts."""

    def __init__(self, parent=None):
        self.texts, self.shown = (parent.texts, parent.shown) if parent else ([], [])

    def _sub(self, **_):
        return Layout(self)

    row = column = split = box = _sub

    def label(self, text="", icon="NONE", translate=True):
        assert icon in ICONS
        self.texts.append(text)

    def prop(self, data, name, text=None, icon="NONE", expand=False):
        assert name in data.bl_rna.properties and icon in ICONS
        self.shown.append(name)

    def operator(self, name, text=None, icon="NONE", translate=True):
        module, _, function = name.partition(".")
        assert getattr(getattr(bpy.ops, module), function).get_rna_type() and icon in ICONS
        self.shown.append(name)

    def progress(self, text="", factor=0.0, type="RING", translate=True):
        assert 0 <= factor <= 1 and type in {"BAR", "RING"}
        self.texts.append(text)
