"""A style for three.js: the effect `stylized` as a hook in lit materials and a pass over the screen, and a picture to hold it to.

Lit materials of three.js know the sum of all light, lamps and probes, so bands, ramps, highlights and rims are the effect's own.
Lines are drawn from a picture of normals, depths and numbers of objects and materials that the pass draws itself.
"""

import json
from pathlib import Path

from ....effects.stylized.settings import HIGHLIGHTS, StylizedSettings
from ...schema import RTGI_VERSION
from ..axes import Y_UP
from ..base import write_text
from ..style import DRAWN, RAMPS, lost_everywhere, picture, style_functions, style_values, write_ramps

FORMAT = "rtgi-three-style/1"
_HERE = Path(__file__).parent / "shaders"


def surface_values(settings: StylizedSettings) -> dict:
    """The uniforms ``style_NAME`` of three.js, by NAME."""
    return {**style_values(settings), "material_borders": settings.material_edges,
            "highlights": HIGHLIGHTS.index(settings.highlights), "highlight_threshold": settings.highlight_threshold,
            "highlight_softness": settings.highlight_softness, "highlight_brightness": settings.highlight_brightness,
            "rim_strength": settings.rim_strength, "rim_width": settings.rim_width, "rim_softness": settings.rim_softness,
            "rim_color": settings.rim_color, "rim_light": settings.rim_light}


def write_style_files(path: Path, settings: StylizedSettings) -> None:
    """Write a style as ``path``, a .json, and the picture of its ramps beside it. Raises OSError or BakeError."""
    tone = (_HERE / "style_uniforms.glsl").read_text(encoding="utf-8") + style_functions()
    description = {
        "format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "ramps": RAMPS, "values": surface_values(settings),
        "glsl": {"tone": tone + (_HERE / "style_surface.glsl").read_text(encoding="utf-8"),
                 "lines": (_HERE / "style_lines.glsl").read_text(encoding="utf-8")},
    }
    write_text(path, json.dumps(description, indent=1) + "\n")
    write_ramps(path.with_name(RAMPS), settings)


def write_style_kit(folder: Path) -> None:
    """A still life, the style that it is drawn in, and the coverage of lines that numpy gives it."""
    write_style_files(folder / "style" / "style.json", DRAWN)
    write_text(folder / "style_picture.json", json.dumps(picture(Y_UP, apart=True)) + "\n")


def notes_on_style(settings: StylizedSettings | None) -> list[str]:
    """What of a style three.js does not get."""
    lost = [] if settings is None else lost_everywhere(settings)
    return [f"three.js's style (rtgi/RTGIStyle.js, WebGLRenderer) goes without {', '.join(lost)}"] if lost else []
