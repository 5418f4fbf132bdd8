"""Painted background: a style that comes with the add-on (tools/style_presets.py)."""

import bpy

style = bpy.context.scene.rtgi_effects.effect_stylized

style.strength = 1.0
style.shading = "bands"
style.bands = 6
style.per_channel = False
style.softness = 6.0
style.key = 3.1416
style.ramp = ""
style.ramp_tint = 1.0
style.shadow_color = (0.05, 0.04, 0.14)
style.shadow_amount = 0.2
style.bleeding = 2.2
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
style.pattern = "none"
style.pattern_spacing = 5.0
style.pattern_tone = 1.0
style.pattern_strength = 1.0
style.pattern_color = (0.01, 0.01, 0.015)
style.paper_color = (0.8, 0.78, 0.7)
style.paper_background = False
style.contrast = 1.1
style.saturation = 1.2
style.tint = (1.0, 1.0, 1.0)
style.lines = True
style.depth_edges = "plane"
style.depth_threshold = 3.0
style.normal_edges = "none"
style.crease_angle = 45.0
style.normal_threshold = 0.5
style.object_edges = True
style.material_edges = False
style.curvature_edges = "none"
style.curvature_threshold = 8.0
style.marked_edges = True
style.line_width = 1.0
style.use_line_world_width = False
style.use_line_thinning = False
style.line_least = 0.5
style.line_color = (0.06, 0.03, 0.08)
style.line_by_material = False
style.line_opacity = 0.35
style.exclude_pass_index = 0
style.exclude_collection = ""
