"""What styles ask of a material: the colour of its lines, and its index."""

from dataclasses import replace

from ...scene import Material


def with_look(material: Material, source) -> Material:
    """``material`` with the Line Art colour and the pass index of the bpy material ``source``."""
    return replace(material, line_color=tuple(source.line_color), pass_index=source.pass_index)
