"""What a user may set of the effect `stylized`."""

from dataclasses import dataclass

import numpy as np

from ..base import setting
from .ramps import parse_ramp

SHADINGS = ("as_lit", "bands", "ramp", "paper")
HIGHLIGHTS = ("as_lit", "band", "ramp", "none")
PATTERNS = ("none", "stipple", "hatching")
DEPTH_EDGES = ("plane", "inverse_depth", "gradient", "none")
NORMAL_EDGES = ("angle", "components", "none")
CURVATURE_EDGES = ("none", "ridges", "valleys", "both")
# No line is wider, whatever is asked for [pixels].
WIDEST = 16.0


@dataclass(frozen=True)
class StylizedSettings:
    """Shading, highlights, rims, patterns, grading, then lines. Colours are scene-linear."""

    strength: float = setting(1.0, "Style Strength", "How much of the styled picture is shown over the lit one", "", 0.0, 1.0)
    shading: str = setting("bands", "Shading",
                           "What light becomes: as it is, bands, a ramp's colours, or a plain sheet of paper", choices=SHADINGS)
    bands: int = setting(3, "Bands", "Treads from dark to the key light; each stands for the middle of its band", "", 1, 16)
    per_channel: bool = setting(False, "Bands per Channel", "Step red, green and blue apart in place of brightness alone")
    softness: float = setting(1.0, "Band Softness", "How wide a step from band to band is", "px", 0.0, 64.0)
    key: float = setting(round(float(np.pi), 4), "Key Light",
                         "Irradiance that counts as full light; at π a white surface is just white", "W/m²", 0.001, 1e6)
    ramp: str = setting("", "Ramp",
                        "Stops of the ramp, as 0:0.1,0.1,0.3 0.5:0.6,0.5,0.5 1:1,1,1 with the word constant before them "
                        "for hard steps; empty is grey from black to white")
    ramp_tint: float = setting(1.0, "Tint by Light", "How much the colour of the light tints the ramp", "", 0.0, 1.0)
    shadow_color: tuple[float, float, float] = setting((0.05, 0.06, 0.2), "Shadow Color", "What dark bands turn towards", "",
                                                       0.0)
    shadow_amount: float = setting(0.0, "Shadow Amount", "How far dark bands turn towards the shadow color", "", 0.0, 1.0)
    bleeding: float = setting(1.0, "Color Bleeding", "Saturation of indirect light; 1 is as it is", "", 0.0, 8.0)
    highlights: str = setting("band", "Highlights", "What the shine of lamps becomes", choices=HIGHLIGHTS)
    highlight_threshold: float = setting(0.5, "Highlight Threshold", "Radiance from which on a shine is a highlight", "", 0.001,
                                         1e4)
    highlight_softness: float = setting(0.2, "Highlight Softness",
                                        "How wide a highlight's edge is, as a share of the threshold", "", 0.0, 2.0)
    highlight_brightness: float = setting(0.8, "Highlight Brightness", "Radiance that a highlight has", "", 0.0, 1e4)
    highlight_ramp: str = setting("", "Highlight Ramp",
                                  "Stops of the ramp that a shine up to the threshold goes through, as those of the other "
                                  "ramp")
    rim_strength: float = setting(0.0, "Rim Strength", "Radiance of the rim light", "", 0.0, 1e4)
    rim_width: float = setting(0.35, "Rim Width",
                               "Cosine to the eye at which the rim begins: on a ball the square of it is the rim's share", "",
                               0.0, 1.0)
    rim_softness: float = setting(0.05, "Rim Softness", "How wide the edge of the rim is, in that cosine", "", 0.0, 1.0)
    rim_color: tuple[float, float, float] = setting((1.0, 1.0, 1.0), "Rim Color", "Colour of the rim light", "", 0.0)
    rim_light: float = setting(0.0, "Rim by Light", "How much the rim shows only on the side where lamps shine", "", 0.0, 1.0)
    pattern: str = setting("none", "Pattern",
                           "What darkness is drawn with: nothing, dots, or strokes that cross where it is dark; anchored "
                           "to objects", choices=PATTERNS)
    pattern_spacing: float = setting(5.0, "Pattern Spacing", "Distance of dots or strokes, to a factor of two", "px", 1.0, 64.0)
    pattern_tone: float = setting(1.0, "Pattern Tone", "Light as a share of the key light from which on there is no ink", "", 0.01,
                                  10.0)
    pattern_strength: float = setting(1.0, "Pattern Strength", "How much of the pattern shows", "", 0.0, 1.0)
    pattern_color: tuple[float, float, float] = setting((0.01, 0.01, 0.015), "Ink Color", "Colour of dots and strokes", "", 0.0)
    paper_color: tuple[float, float, float] = setting((0.8, 0.78, 0.7), "Paper Color",
                                                      "What the shading Paper shows, and the background if it is paper", "",
                                                      0.0)
    paper_background: bool = setting(False, "Paper Background", "Show paper where nothing is seen, in place of the world")
    contrast: float = setting(1.0, "Contrast", "Contrast of the picture about middle grey", "", 0.1, 8.0)
    saturation: float = setting(1.0, "Saturation", "Saturation of the picture", "", 0.0, 8.0)
    tint: tuple[float, float, float] = setting((1.0, 1.0, 1.0), "Tint", "Colour that the picture is multiplied by", "", 0.0)
    lines: bool = setting(True, "Lines", "Draw lines over the picture")
    depth_edges: str = setting("plane", "Depth Lines",
                               "Where something stands in front: by the distance from the other pixel's plane, by the "
                               "second difference of 1/depth, or by the depth's own gradient", choices=DEPTH_EDGES)
    depth_threshold: float = setting(3.0, "Depth Threshold", "Step that makes a line, in pixels at that distance", "px", 0.1,
                                     1e4)
    normal_edges: str = setting("angle", "Crease Lines",
                                "Where surfaces turn: by the angle between normals, or by the largest change of a component",
                                choices=NORMAL_EDGES)
    crease_angle: float = setting(45.0, "Crease Angle", "Normals that differ by more make a line", "°", 1.0, 180.0)
    normal_threshold: float = setting(0.5, "Normal Threshold",
                                      "Change of a normal's component that makes a line, if lines go by components", "", 0.01,
                                      2.0)
    object_edges: bool = setting(True, "Object Borders", "Lines where one object ends and another begins")
    material_edges: bool = setting(True, "Material Borders", "Lines where one material ends and another begins")
    curvature_edges: str = setting("none", "Curvature Lines", "Lines along what bulges, what is hollow, or both",
                                   choices=CURVATURE_EDGES)
    curvature_threshold: float = setting(8.0, "Curvature Threshold", "Turn of the normal over a pixel that makes a line", "°",
                                         0.1, 180.0)
    marked_edges: bool = setting(True, "Marked Edges", "Lines along edges marked for Freestyle")
    line_width: float = setting(1.5, "Line Width", "Width of a line", "px", 0.1, WIDEST)
    line_world_width: float | None = setting(None, "World Width", "Width of a line in the world, in place of pixels", "m", 1e-5,
                                             1e3)
    line_thinning: float | None = setting(None, "Thinning Distance",
                                          "Lines that are further away are thinner in proportion; unset keeps their width", "m",
                                          0.01, 1e6)
    line_least: float = setting(0.5, "Least Width", "Width that no line falls below, however far away", "px", 0.0, WIDEST)
    line_color: tuple[float, float, float] = setting((0.0, 0.0, 0.0), "Line Color", "Colour of lines", "", 0.0)
    line_by_material: bool = setting(False, "Color by Material",
                                     "Take the colour and opacity of lines from each material's Line Art settings")
    line_opacity: float = setting(1.0, "Line Opacity", "How much lines cover", "", 0.0, 1.0)
    exclude_pass_index: int = setting(0, "Exclude Pass Index",
                                      "Objects and materials with this pass index have no lines of their own; 0 excludes none",
                                      "", 0, 32767)
    exclude_collection: str = setting("", "Exclude Collection", "Objects of this collection have no lines of their own")

    def __post_init__(self):
        """Raises UsageError for a text that is no ramp."""
        for text in (self.ramp, self.highlight_ramp):
            parse_ramp(text)
