// Lines, paper and grading over a picture. `surfaces` holds what every pixel shows: its normal in the camera's space (two numbers of an
// octahedron), its depth along the view [m], and 1024 * object + material, 0 for nothing. Steps in depth go by the second difference
// of 1/depth, which is 0 on planes. Pixels count from the lower left corner.

const float RTGI_UNKNOWN = 1e30;

vec4 rtgi_surface(ivec2 texel) {
	return texelFetch(surfaces, texel, 0);
}

vec3 rtgi_normal_of(vec4 surface) {
	vec3 normal = vec3(surface.xy, 1.0 - abs(surface.x) - abs(surface.y));
	if (normal.z < 0.0) {
		normal.xy = (1.0 - abs(normal.yx)) * vec2(normal.x < 0.0 ? -1.0 : 1.0, normal.y < 0.0 ? -1.0 : 1.0);
	}
	return normalize(normal);
}

bool rtgi_inside(ivec2 texel, ivec2 size) {
	return all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, size));
}

float rtgi_second_difference(ivec2 texel, ivec2 along, ivec2 size) {
	if (!rtgi_inside(texel - along, size) || !rtgi_inside(texel + along, size)) {
		return RTGI_UNKNOWN;
	}
	vec4 before = rtgi_surface(texel - along);
	vec4 after = rtgi_surface(texel + along);
	if (before.w == 0.0 || after.w == 0.0) {
		return RTGI_UNKNOWN;
	}
	float here = rtgi_surface(texel).z;
	return parallel ? abs(before.z - 2.0 * here + after.z) : abs(1.0 / before.z - 2.0 / here + 1.0 / after.z);
}

bool rtgi_is_border(ivec2 here, ivec2 there, vec4 one, vec4 other, float nearest, ivec2 size) {
	if (one.w == 0.0 || other.w == 0.0) {
		return style_contours && one.w != other.w;
	}
	vec2 objects = floor(vec2(one.w, other.w) / 1024.0);
	vec2 materials = vec2(one.w, other.w) - 1024.0 * objects;
	if ((style_contours && objects.x != objects.y) || (style_material_borders && materials.x != materials.y)) {
		return true;
	}
	float change = min(rtgi_second_difference(here, there - here, size), rtgi_second_difference(there, there - here, size));
	change *= parallel ? 1.0 : one.z * other.z;
	float footprint = parallel ? pixelWidth : nearest * pixelWidth;
	return (change < 1e20 && change > style_depth_threshold * footprint) ||
		(style_creases && dot(rtgi_normal_of(one), rtgi_normal_of(other)) < style_crease_cosine);
}

// Half the width of the line between a pixel and the next along an axis, 0 where there is none.
float rtgi_border(ivec2 here, ivec2 along, ivec2 size) {
	ivec2 there = here + along;
	if (!rtgi_inside(here, size) || !rtgi_inside(there, size)) {
		return 0.0;
	}
	vec4 one = rtgi_surface(here);
	vec4 other = rtgi_surface(there);
	float nearest = min(one.w == 0.0 ? RTGI_UNKNOWN : one.z, other.w == 0.0 ? RTGI_UNKNOWN : other.z);
	if (!rtgi_is_border(here, there, one, other, nearest, size)) {
		return 0.0;
	}
	float width = style_line_width;
	if (style_line_thinning > 0.0) {
		width *= min(style_line_thinning / max(nearest, 1e-12), 1.0);
	}
	return 0.5 * max(width, style_line_least);
}

// How much of a pixel lines cover.
float rtgi_line_coverage(ivec2 texel, ivec2 size) {
	int reach = int(ceil(0.5 * max(style_line_width, style_line_least)));
	float deepest = -1.0;
	for (int axis = 0; axis < 2; ++axis) {
		ivec2 along = axis == 0 ? ivec2(1, 0) : ivec2(0, 1);
		for (int y = -reach; y <= reach + axis; ++y) {
			for (int x = -reach; x <= reach + 1 - axis; ++x) {
				float away = length(vec2(float(x), float(y)) - 0.5 * vec2(along));
				float half_width = rtgi_border(texel - ivec2(x, y), along, size);
				if (half_width > 0.0) {
					deepest = max(deepest, half_width - away);
				}
			}
		}
	}
	return clamp(deepest + 0.5, 0.0, 1.0);
}

// `color`, what was drawn at a pixel, in the style; `cosine` is that between its normal and the way to the eye.
vec3 rtgi_styled_pixel(ivec2 texel, vec3 color, float cosine) {
	bool shown = rtgi_surface(texel).w != 0.0;
	if (shown && style_shading == 3) {
		// Paper knows no light.
		color = style_paper_color + rtgi_rim(cosine, 1.0);
	} else if (!shown && style_paper_background) {
		color = style_paper_color;
	}
	color = rtgi_graded(color);
	if (style_lines) {
		color = mix(color, style_line_color, rtgi_line_coverage(texel, textureSize(surfaces, 0)) * style_line_opacity);
	}
	return color;
}
