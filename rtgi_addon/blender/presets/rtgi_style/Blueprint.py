"""Blueprint: a style that comes with the add-on (tools/style_presets.py)."""

import bpy

style = bpy.context.scene.rtgi_effects.effect_stylized

style.strength = 1.0
style.shading = "paper"
style.bands = 3
style.per_channel = False
style.softness = 1.0
style.key = 3.1416
style.ramp = ""
style.ramp_tint = 1.0
style.shadow_color = (0.05, 0.06, 0.2)
style.shadow_amount = 0.0
style.bleeding = 1.0
style.highlights = "band"
style.highlight_threshold = 0.5
style.highlight_softness = 0.2
style.highlight_brightness = 0.8
style.highlight_ramp = ""
style.rim_strength = 0.02
style.rim_width = 0.6
style.rim_softness = 0.8
style.rim_color = (0.4, 0.7, 1.0)
style.rim_light = 0.0
style.pattern = "none"
style.pattern_spacing = 5.0
style.pattern_tone = 1.0
style.pattern_strength = 1.0
style.pattern_color = (0.01, 0.01, 0.015)
style.paper_color = (0.008, 0.045, 0.19)
style.paper_background = True
style.contrast = 1.0
style.saturation = 1.0
style.tint = (1.0, 1.0, 1.0)
style.lines = True
style.depth_edges = "plane"
style.depth_threshold = 3.0
style.normal_edges = "angle"
style.crease_angle = 20.0
style.normal_threshold = 0.5
style.object_edges = True
style.material_edges = True
style.curvature_edges = "none"
style.curvature_threshold = 8.0
style.marked_edges = True
style.line_width = 1.2
style.use_line_world_width = False
style.use_line_thinning = False
style.line_least = 0.5
style.line_color = (0.75, 0.88, 1.0)
style.line_by_material = False
style.line_opacity = 1.0
style.exclude_pass_index = 0
style.exclude_collection = ""
