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

    def prop(self, data, name, text=None, icon="NONE", expand=False, translate=True):
        assert name in data.bl_rna.properties and icon in ICONS
        self.shown.append(name)

    def prop_search(self, data, name, owner, collection, text=None, icon="NONE"):
        assert name in data.bl_rna.properties and collection in owner.bl_rna.properties
        self.shown.append(name)

    def popover(self, panel, text="", icon="NONE"):
        assert hasattr(bpy.types, panel) and icon in ICONS
        self.shown.append(panel)

    def separator(self):
        pass

    def operator(self, name, text=None, icon="NONE", translate=True, emboss=True):
        module, _, function = name.partition(".")
        declared = getattr(getattr(bpy.ops, module), function).get_rna_type().properties
        assert icon in ICONS
        self.shown.append(name)
        if text:
            self.texts.append(text)
        return _Options(declared.keys())

    def progress(self, text="", factor=0.0, type="RING", translate=True):
        assert 0 <= factor <= 1 and type in {"BAR", "RING"}
        self.texts.append(text)


class _Options:
    """What an operator's button is given: only properties that the operator has."""

    def __init__(self, declared):
        object.__setattr__(self, "_declared", set(declared))

    def __setattr__(self, name, value):
        assert name in self._declared
        object.__setattr__(self, name, value)
