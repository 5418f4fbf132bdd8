"""Stylized rendering: bands, ramps, highlights, rims, ink and lines over the light that is really there.

Source: G. Papaioannou, *Real-Time Dynamic Global Illumination* (2020), last chapter; what each part follows beside it is said in
its module. Bands are made of irradiance, direct and indirect, so that the shadow side of a red wall's neighbour is a red tread.
What it is not: strokes along the lines (there is no chain of edges to follow), and bands of the mean over a picture's samples:
each sample has its own, so that the penumbra of a wide lamp settles into a soft step.

`settings` and `presets` are the user's side; `tone`, `ramps`, `shading` and `grading` colour surfaces, `pattern` inks them; `edges`
finds lines, `strokes` draws them, `marked` draws those along edges marked by hand.
"""

import numpy as np

from ...scene import Scene
from ..base import Effect
from ..frame import Frame
from .edges import find_borders
from .grading import changes_colours, graded
from .marked import draw_marked, has_marked, segments
from .pattern import anchors, ink
from .ramps import ramp_table
from .settings import WIDEST, StylizedSettings
from .shading import changes_surfaces, left_by_media, restyled, tones
from .strokes import draw_lines, over
from .tables import excluded, line_colours


class Stylized(Effect):
    """See the module's docstring."""

    name, label, description = "stylized", "Stylized", "Bands, ink and lines in place of smooth light"
    stage = "style"
    Settings = StylizedSettings
    sections = (("Highlights and Rim", "highlights", "rim_light"), ("Ink and Paper", "pattern", "paper_background"),
                ("Grading", "contrast", "tint"), ("Lines", "lines", "exclude_collection"))

    def parameters(self, settings: StylizedSettings, scene: Scene) -> dict:
        """See Effect.parameters; with the tables of the scene's materials and instances, which the GPU has as textures."""
        values = super().parameters(settings, scene)
        instance_excluded, material_excluded = excluded(scene, settings.exclude_pass_index, settings.exclude_collection)
        unlimited = settings.line_world_width is not None
        return {**values, "ramp": ramp_table(settings.ramp), "highlight_ramp": ramp_table(settings.highlight_ramp),
                "crease_cosine": float(np.cos(np.radians(settings.crease_angle))),
                "curvature_radians": float(np.radians(settings.curvature_threshold)),
                "line_world_width": settings.line_world_width or 0.0, "line_thinning": settings.line_thinning or 0.0,
                "line_widest": WIDEST if unlimited else max(settings.line_width, settings.line_least),
                "instance_excluded": instance_excluded, "material_excluded": material_excluded,
                "line_colors": line_colours(scene, settings),
                "anchors": anchors(scene) if settings.pattern != "none" else np.zeros((0, 4, 3), np.float32)}

    def apply(self, frame: Frame, field, settings: StylizedSettings) -> np.ndarray:
        """See Effect.apply."""
        if settings.strength == 0.0:
            return frame.light
        values = self.parameters(settings, frame.scene)
        picture, seen = frame.light, frame.gbuffer.seen
        tone, change = tones(frame, values)
        if changes_surfaces(values):
            picture = restyled(frame, values, tone, change)
        if values["pattern"] and values["pattern_strength"] > 0:
            picture = picture.copy()
            darkness = 1 - np.minimum(tone[seen] / np.float32(values["pattern_tone"]), 1.0)
            share = ink(frame, values, darkness)[:, None] * np.float32(values["pattern_strength"])
            left = left_by_media(frame)
            share = share if left is None else share * left[seen]
            picture[seen, :3] += (np.float32(values["pattern_color"]) - picture[seen][:, :3]) * share
        if values["paper_background"]:
            picture = np.where(seen[..., None], picture, np.float32([*values["paper_color"], 1.0]))
        if changes_colours(values):
            picture = graded(picture, values)
        if values["lines"] and values["line_opacity"] > 0:
            lines = draw_lines(find_borders(frame, values), values["line_widest"], _marked(frame, values))
            picture = over(picture, lines, values["line_colors"])
        if settings.strength < 1.0:
            picture = frame.light + (picture - frame.light) * np.float32(settings.strength)
        return np.asarray(picture, np.float32)


def _marked(frame: Frame, values: dict):
    """What `strokes` draws of edges marked by hand, None where there are none."""
    if not values["marked_edges"] or not has_marked(frame.scene):
        return None
    return draw_marked(frame, segments(frame.scene, frame.view, frame.size, frame.offset, values))


EFFECT = Stylized()
