float rtgi_luminance(vec3 color) {
	return dot(color, vec3(0.2126, 0.7152, 0.0722));
}

vec3 rtgi_saturated(vec3 color, float amount) {
	float grey = rtgi_luminance(color);
	return max(vec3(grey) + (color - grey) * amount, vec3(0.0));
}

// `tone` in equal treads from 0 to 1, each as bright as its middle, with steps `wide`.
float rtgi_banded(float tone, float wide) {
	if (style_bands == 1) {
		return 0.5;
	}
	float place = tone * float(style_bands);
	float border = clamp(floor(place + 0.5), 1.0, float(style_bands) - 1.0);
	float step_width = clamp(wide * float(style_bands), 1e-6, 1.0);
	return (border - 0.5 + smoothstep(0.0, 1.0, (place - border) / step_width + 0.5)) / float(style_bands);
}

// The ramp in row 0 (of light) or 1 (of highlights) of the picture of ramps.
vec3 rtgi_ramp(float tone, int row) {
	vec2 place = vec2(0.5 / 64.0 + clamp(tone, 0.0, 1.0) * 63.0 / 64.0, 0.25 + 0.5 * float(row));
	return texture(style_ramps, place).rgb * style_ramp_scale;
}

// Irradiance in the style, of that of lamps and that of all else; `change` is how much tone changes over a pixel.
vec3 rtgi_styled_light(vec3 direct, vec3 indirect, float change) {
	float tone = rtgi_luminance(direct + indirect) / style_key;
	vec3 light = direct + rtgi_saturated(indirect, style_bleeding);
	float brightness = rtgi_luminance(light);
	vec3 hue = brightness > 1e-12 ? light / max(brightness, 1e-20) : vec3(1.0);
	float wide = change * style_softness;
	float level = tone;
	if (style_shading == 1) {
		level = rtgi_banded(tone, wide);
		vec3 share = light / style_key;
		light = (style_per_channel ? vec3(rtgi_banded(share.r, wide), rtgi_banded(share.g, wide), rtgi_banded(share.b, wide))
				: hue * level) * style_key;
	} else if (style_shading == 2) {
		light = rtgi_ramp(tone, 0) * (1.0 + (hue - 1.0) * style_ramp_tint) * style_key;
	}
	return mix(light, style_shadow_color * style_key, style_shadow_amount * (1.0 - clamp(level, 0.0, 1.0)));
}

vec3 rtgi_graded(vec3 color) {
	vec3 graded = color * pow(max(rtgi_luminance(color), 1e-12) / 0.18, style_contrast - 1.0);
	return rtgi_saturated(graded, style_saturation) * style_tint;
}
