"""What a measuring tool's panel asks before it measures: the operator's own properties once more, kept with the scene.

Scripts give them to the operator; the panel's button passes on what the scene holds.
"""

import bpy

from .panel_kinds import split


class ToolSettings:
    """The properties ``names`` of ``operator`` as ``Scene.<name>``."""

    def __init__(self, name: str, operator: type, names: tuple[str, ...]):
        self._name, self._names = name, names
        self._group = type(f"RTGI_PG_{name.removeprefix('rtgi_')}_settings", (bpy.types.PropertyGroup,), {
            "__annotations__": {entry: operator.__annotations__[entry] for entry in names}})

    def draw(self, layout, scene: bpy.types.Scene, enabled: bool) -> None:
        """The properties as settings; grey while the tool runs."""
        column = split(layout.column())
        column.enabled = enabled
        for name in self._names:
            column.prop(getattr(scene, self._name), name)

    def give(self, button, scene: bpy.types.Scene) -> None:
        """Set the properties of the operator behind ``button``."""
        for name in self._names:
            setattr(button, name, getattr(getattr(scene, self._name), name))

    def register(self) -> None:
        """Put them on scenes."""
        bpy.utils.register_class(self._group)
        setattr(bpy.types.Scene, self._name, bpy.props.PointerProperty(type=self._group))

    def unregister(self) -> None:
        """Take them out."""
        delattr(bpy.types.Scene, self._name)
        bpy.utils.unregister_class(self._group)
