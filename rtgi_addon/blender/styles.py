"""Styles by name: those of the product, and the user's own among Blender's presets."""

import ast
from pathlib import Path

from ..effects.stylized.presets import STYLES
from ..errors import UsageError

__all__ = ["FOLDER", "STYLES", "STYLIZED", "VARIABLE", "is_shipped", "read_style", "style_file", "style_settings"]

# The effect's name, the folder among Blender's presets, and what a preset calls the settings that it sets.
STYLIZED, FOLDER, VARIABLE = "stylized", "rtgi_style", "style"


def is_shipped(name: str) -> bool:
    """Whether the style called ``name`` comes with the product."""
    return _plain(name) in STYLES


def style_settings(name: str) -> dict:
    """The settings of the style called ``name`` that differ from the effect's defaults; spaces and capitals count for nothing.
    Raises UsageError with the list of those there are."""
    wanted = _plain(name)
    if wanted in STYLES:
        return STYLES[wanted]
    # Blender speaks while it is loaded: a command line gets here once its streams are its own.
    import bpy
    own = {_plain(path.stem): path for folder in bpy.utils.preset_paths(FOLDER) for path in sorted(Path(folder).glob("*.py"))}
    if wanted not in own:
        raise UsageError(f"unknown style {name!r}", f"choose one of {', '.join(dict.fromkeys([*STYLES, *own]))}")
    return read_style(own[wanted].read_text(encoding="utf-8"))


def read_style(text: str) -> dict:
    """The settings that a preset's ``text`` sets, without running it: lines ``style.NAME = VALUE``, where those that may be unset
    have a line ``style.use_NAME`` as well. Anything else in it is left aside."""
    values = {}
    for statement in ast.parse(text).body:
        target = statement.targets[0] if isinstance(statement, ast.Assign) else None
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name) and target.value.id == VARIABLE:
            value = ast.literal_eval(statement.value)
            values[target.attr] = tuple(value) if isinstance(value, list) else value
    unset = {name.removeprefix("use_") for name, value in values.items() if name.startswith("use_") and not value}
    return {name: None if name in unset else value for name, value in values.items() if not name.startswith("use_")}


def style_file(title: str, settings: dict, defaults) -> str:
    """The preset called ``title`` that sets ``settings``, and what they do not name as in ``defaults``, as Blender writes one."""
    lines = [f'"""{title}: a style that comes with the add-on (tools/style_presets.py)."""', "", "import bpy", "",
             f"{VARIABLE} = bpy.context.scene.rtgi_effects.effect_{STYLIZED}", ""]
    for name, default in vars(defaults).items():
        value = settings.get(name, default)
        if default is None:
            lines.append(f"{VARIABLE}.use_{name} = {value is not None}")
        if value is not None:
            lines.append(f"{VARIABLE}.{name} = {_literal(value)}")
    return "\n".join(lines) + "\n"


def _literal(value) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _plain(name: str) -> str:
    return "_".join(name.lower().replace("-", " ").replace("_", " ").split())
