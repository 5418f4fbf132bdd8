"""A style for Godot: the effect `stylized` as a pass over the screen and as an include for surfaces, and a picture to hold it to.

Godot says neither which object a pixel shows nor what light arrives at it, so the pass has lines by depth and normals, paper and
grading, and the include bands and ramps for surfaces, of each light by itself. `notes_on_style` says what a style loses.
"""

import json
from pathlib import Path

from ....effects.stylized.settings import StylizedSettings
from ..axes import Y_UP
from ..base import copy_files, write_text
from ..style import DRAWN, RAMPS, lost_everywhere, picture, style_functions, style_values, write_ramps
from .textures import IMPORT

FILES = Path(__file__).parent / "files" / "style"
_ADDON_FILES = ("style_view.gdshader", "style.gd", "style.tscn")
INCLUDE = "style.gdshaderinc"
INDEX, EXPECTED, SCRIPT = "style.json", "style_picture.json", "style_picture.gd"
# Lossless, and not turned into blocks once the editor sees the picture in 3D.
_IMPORT = """\
[remap]

importer="texture"
type="CompressedTexture2D"

[params]

compress/mode=0
mipmaps/generate=false
detect_3d/compress_to=0
"""


def write_style(folder: Path, settings: StylizedSettings) -> None:
    """The files of a style, for the folder that goes into a project."""
    copy_files(FILES, folder, _ADDON_FILES)
    include = (FILES / f"{INCLUDE}.in").read_text(encoding="utf-8")
    write_text(folder / INCLUDE, include.replace("@STYLE@", style_functions()))
    write_text(folder / INDEX, json.dumps({"style": style_values(settings)}) + "\n")
    write_ramps(folder / RAMPS, settings)
    write_text(folder / f"{RAMPS}{IMPORT}", _IMPORT)


def write_style_kit(folder: Path) -> None:
    """A still life, the style that it is drawn in, and the coverage of lines that numpy gives it, with the script that compares."""
    write_style(folder / "style", DRAWN)
    # All is one object: Godot does not tell them apart.
    write_text(folder / EXPECTED, json.dumps(picture(Y_UP, apart=False)) + "\n")
    copy_files(FILES / "conformance", folder, [SCRIPT])


def notes_on_style(settings: StylizedSettings | None) -> list[str]:
    """What of a style Godot does not get."""
    if settings is None:
        return []
    lost = [what for what, there in (
        ("borders of objects and materials", settings.object_edges or settings.material_edges),
        ("the rim", settings.rim_strength > 0), ("highlights of their own", settings.highlights != "as_lit")) if there]
    lost += lost_everywhere(settings)
    return [f"Godot's style (rtgi/style.tscn, Forward+) goes without {', '.join(lost)}"] if lost else []
