"""Ink and wash: a style that comes with the add-on (tools/style_presets.py)."""

import bpy

style = bpy.context.scene.rtgi_effects.effect_stylized

style.strength = 1.0
style.shading = "ramp"
style.bands = 3
style.per_channel = False
style.softness = 1.0
style.key = 3.1416
style.ramp = "0:0.3,0.33,0.42 0.1:0.55,0.57,0.62 0.3:0.95,0.95,0.93 0.7:1.25,1.2,1.1 1:1.4,1.35,1.25"
style.ramp_tint = 0.3
style.shadow_color = (0.05, 0.06, 0.2)
style.shadow_amount = 0.0
style.bleeding = 1.0
style.highlights = "none"
style.highlight_threshold = 0.5
style.highlight_softness = 0.2
style.highlight_brightness = 0.8
style.highlight_ramp = ""
style.rim_strength = 0.0
style.rim_width = 0.35
style.rim_softness = 0.05
style.rim_color = (1.0, 1.0, 1.0)
style.rim_light = 0.0
style.pattern = "hatching"
style.pattern_spacing = 6.0
style.pattern_tone = 0.3
style.pattern_strength = 0.7
style.pattern_color = (0.01, 0.01, 0.015)
style.paper_color = (0.86, 0.82, 0.72)
style.paper_background = True
style.contrast = 1.0
style.saturation = 0.6
style.tint = (1.0, 1.0, 1.0)
style.lines = True
style.depth_edges = "plane"
style.depth_threshold = 3.0
style.normal_edges = "angle"
style.crease_angle = 30.0
style.normal_threshold = 0.5
style.object_edges = True
style.material_edges = True
style.curvature_edges = "none"
style.curvature_threshold = 8.0
style.marked_edges = True
style.line_width = 1.4
style.use_line_world_width = False
style.use_line_thinning = False
style.line_least = 0.5
style.line_color = (0.015, 0.012, 0.02)
style.line_by_material = False
style.line_opacity = 1.0
style.exclude_pass_index = 0
style.exclude_collection = ""
