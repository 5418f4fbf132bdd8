"""Styles that come with the product: settings of the effect `stylized` that differ from its defaults, by name."""

_RAMP_OF_WASH = "0:0.3,0.33,0.42 0.1:0.55,0.57,0.62 0.3:0.95,0.95,0.93 0.7:1.25,1.2,1.1 1:1.4,1.35,1.25"

STYLES: dict[str, dict] = {
    "cel": {"bands": 3, "shadow_color": (0.02, 0.03, 0.12), "shadow_amount": 0.25, "bleeding": 1.6, "saturation": 1.15,
            "rim_strength": 0.12, "rim_light": 1.0, "line_width": 1.8},
    "ink_and_wash": {"shading": "ramp", "ramp": _RAMP_OF_WASH, "ramp_tint": 0.3, "highlights": "none", "pattern": "hatching",
                     "pattern_spacing": 6.0, "pattern_tone": 0.3, "pattern_strength": 0.7, "paper_color": (0.86, 0.82, 0.72),
                     "paper_background": True, "saturation": 0.6, "crease_angle": 30.0, "line_width": 1.4,
                     "line_color": (0.015, 0.012, 0.02)},
    "blueprint": {"shading": "paper", "paper_color": (0.008, 0.045, 0.19), "paper_background": True, "rim_strength": 0.02,
                  "rim_width": 0.6, "rim_softness": 0.8, "rim_color": (0.4, 0.7, 1.0), "crease_angle": 20.0, "line_width": 1.2,
                  "line_color": (0.75, 0.88, 1.0)},
    "painted_background": {"bands": 6, "softness": 6.0, "bleeding": 2.2, "shadow_color": (0.05, 0.04, 0.14), "shadow_amount": 0.2,
                           "highlights": "none", "saturation": 1.2, "contrast": 1.1, "normal_edges": "none",
                           "material_edges": False, "line_width": 1.0, "line_opacity": 0.35, "line_color": (0.06, 0.03, 0.08)},
}
