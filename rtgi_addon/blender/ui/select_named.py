"""Selecting in the viewport what a line of a report is about."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

SEPARATOR = "\n"


class RTGI_OT_select_named(bpy.types.Operator):
    """Select the objects that this line is about"""

    bl_idname = "rtgi.select_named"
    bl_label = "Select What a Line Is About"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    objects: bpy.props.StringProperty(name="Objects", description="Names of objects, one a line", options={"HIDDEN"})
    materials: bpy.props.StringProperty(name="Materials", description="Names of materials, one a line: whatever carries one of "
                                        "them is selected", options={"HIDDEN"})

    def execute(self, context):
        """Select them, and nothing else; of what is only there as an instance, what makes the instances."""
        found = _found(context, set(filter(None, self.objects.split(SEPARATOR))),
                       set(filter(None, self.materials.split(SEPARATOR))))
        if not found:
            self.report({"WARNING"}, rpt_("Nothing of that name can be selected in this view layer"))
            return {"CANCELLED"}
        for obj in context.view_layer.objects:
            obj.select_set(obj in found)
        context.view_layer.objects.active = found[0]
        return {"FINISHED"}


def _found(context, names: set[str], materials: set[str]) -> list:
    """The view layer's objects that are called ``names`` or carry ``materials``, or through which such are instanced."""
    def is_meant(obj) -> bool:
        return obj.name in names or any(slot.material is not None and slot.material.name in materials
                                        for slot in obj.material_slots)

    def makes(obj) -> bool:
        collection = obj.instance_collection
        return collection is not None and any(map(is_meant, collection.all_objects))

    selectable = [obj for obj in context.view_layer.objects if obj.visible_get(view_layer=context.view_layer)]
    return [obj for obj in selectable if is_meant(obj)] or [obj for obj in selectable if makes(obj)]


def register() -> None:
    """Register the operator."""
    bpy.utils.register_class(RTGI_OT_select_named)


def unregister() -> None:
    """Take it out."""
    bpy.utils.unregister_class(RTGI_OT_select_named)
