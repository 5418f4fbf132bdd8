uniform sampler2D style_ramps;
uniform float style_ramp_scale;
uniform int style_shading; // 0 as lit, 1 bands, 2 ramp, 3 paper
uniform int style_bands;
uniform bool style_per_channel;
uniform float style_softness;
uniform float style_key;
uniform float style_ramp_tint;
uniform vec3 style_shadow_color;
uniform float style_shadow_amount;
uniform float style_bleeding;
uniform vec3 style_paper_color;
uniform bool style_paper_background;
uniform float style_contrast;
uniform float style_saturation;
uniform vec3 style_tint;
uniform bool style_lines;
uniform float style_depth_threshold;
uniform float style_crease_cosine;
uniform bool style_creases;
uniform bool style_contours;
uniform bool style_material_borders;
uniform float style_line_width;
uniform float style_line_thinning;
uniform float style_line_least;
uniform vec3 style_line_color;
uniform float style_line_opacity;
uniform int style_highlights; // 0 as lit, 1 band, 2 ramp, 3 none
uniform float style_highlight_threshold;
uniform float style_highlight_softness;
uniform float style_highlight_brightness;
uniform float style_rim_strength;
uniform float style_rim_width;
uniform float style_rim_softness;
uniform vec3 style_rim_color;
uniform float style_rim_light;

