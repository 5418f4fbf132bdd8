
// What a shine, the radiance that a layer reflects of lamps, becomes.
vec3 rtgi_styled_shine(vec3 shine) {
	float brightness = rtgi_luminance(shine);
	if (style_highlights == 0 || brightness <= 0.0) {
		return style_highlights == 0 ? shine : vec3(0.0);
	}
	vec3 hue = shine / brightness;
	if (style_highlights == 1) {
		float wide = max(style_highlight_softness * style_highlight_threshold, 1e-6);
		return hue * smoothstep(0.0, 1.0, (brightness - style_highlight_threshold) / wide + 0.5) * style_highlight_brightness;
	}
	return style_highlights == 2 ? hue * rtgi_ramp(brightness / style_highlight_threshold, 1) * style_highlight_brightness : vec3(0.0);
}

// The rim light, by the cosine between the normal and the way to the eye; `lamps` is their irradiance over the key light's.
vec3 rtgi_rim(float cosine, float lamps) {
	float share = 1.0 - smoothstep(0.0, 1.0, (cosine - style_rim_width) / max(style_rim_softness, 1e-6) + 0.5);
	return style_rim_color * (share * mix(1.0, min(lamps, 1.0), style_rim_light) * style_rim_strength);
}
