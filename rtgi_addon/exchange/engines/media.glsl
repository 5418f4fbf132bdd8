// Media of a bake: what they take, give and scatter at points and along rays. GLSL that Godot's shaders and WebGL have in common;
// media.py is its twin and says where it is from. Directions are those in which a camera looks.
//
// A medium's cells: one block is density (in red), three, one after the other in z, are the scattering, absorption and emission, that
// the medium's own are multiplied by. `ambient` has seven blocks of the radiance in SH over RTGI_AMBIENT_SCALE: red 0-3, red 4-7, green,
// blue, and the eighths of all three.

#define RTGI_THIN 0.01

// What a slice of optical depth tau lets out of what it gives: (1 - e^-tau)/tau.
vec3 rtgi_slice_share(vec3 depth) {
	vec3 thick = (1.0 - exp(-depth)) / max(depth, vec3(RTGI_THIN));
	return mix(thick, 1.0 - depth * (0.5 - depth / 6.0), step(depth, vec3(RTGI_THIN)));
}

// Where in a texture of several blocks a point of the unit box lies: never between two blocks.
vec3 rtgi_in_block(vec3 unit_point, vec3 size, float block, float blocks) {
	vec3 texel = clamp(unit_point * size, vec3(0.5), size - 0.5);
	return vec3(texel.xy / size.xy, (texel.z + block * size.z) / (blocks * size.z));
}

// Adds what a medium is at a point; size is the number of cells, and of blocks.
void rtgi_medium(sampler3D cells, mat4 unit_from_world, vec4 size, vec3 scattering, vec3 absorption, vec3 emission, vec2 moments,
		vec3 point, inout vec3 extinction, inout vec3 given, inout vec3 band0, inout vec3 band1, inout vec3 band2) {
	vec3 unit_point = (unit_from_world * vec4(point, 1.0)).xyz;
	if (any(lessThan(unit_point, vec3(0.0))) || any(greaterThan(unit_point, vec3(1.0)))) {
		return;
	}
	vec3 scattered = textureLod(cells, rtgi_in_block(unit_point, size.xyz, 0.0, size.w), 0.0).rgb;
	vec3 absorbed = scattered.rrr;
	vec3 emitted = vec3(1.0);
	if (size.w > 1.5) {
		absorbed = textureLod(cells, rtgi_in_block(unit_point, size.xyz, 1.0, size.w), 0.0).rgb;
		emitted = textureLod(cells, rtgi_in_block(unit_point, size.xyz, 2.0, size.w), 0.0).rgb;
	} else {
		scattered = absorbed;
	}
	scattered *= scattering;
	extinction += scattered + absorption * absorbed;
	given += emission * emitted;
	band0 += scattered;
	band1 += moments.x * scattered;
	band2 += moments.y * scattered;
}

// What bands 0, 1 and 2 of the ambient light make along a direction, of a medium that scatters evenly.
void rtgi_ambient_bands(sampler3D ambient, vec3 size, vec3 unit_point, vec3 d, out vec3 band0, out vec3 band1, out vec3 band2) {
	vec4 red_low = textureLod(ambient, rtgi_in_block(unit_point, size, 0.0, 7.0), 0.0);
	vec4 red_high = textureLod(ambient, rtgi_in_block(unit_point, size, 1.0, 7.0), 0.0);
	vec4 green_low = textureLod(ambient, rtgi_in_block(unit_point, size, 2.0, 7.0), 0.0);
	vec4 green_high = textureLod(ambient, rtgi_in_block(unit_point, size, 3.0, 7.0), 0.0);
	vec4 blue_low = textureLod(ambient, rtgi_in_block(unit_point, size, 4.0, 7.0), 0.0);
	vec4 blue_high = textureLod(ambient, rtgi_in_block(unit_point, size, 5.0, 7.0), 0.0);
	vec3 last = textureLod(ambient, rtgi_in_block(unit_point, size, 6.0, 7.0), 0.0).rgb;
	vec3 first = 0.4886025 * vec3(d.y, d.z, d.x);
	vec4 second = vec4(1.0925484 * d.x * d.y, 1.0925484 * d.y * d.z, 0.3153916 * (3.0 * d.z * d.z - 1.0), 1.0925484 * d.x * d.z);
	band0 = RTGI_AMBIENT_SCALE * 0.2820948 * vec3(red_low.x, green_low.x, blue_low.x);
	band1 = RTGI_AMBIENT_SCALE * vec3(dot(first, red_low.yzw), dot(first, green_low.yzw), dot(first, blue_low.yzw));
	band2 = RTGI_AMBIENT_SCALE * (vec3(dot(second, red_high), dot(second, green_high), dot(second, blue_high))
			+ 0.5462742 * (d.x * d.x - d.y * d.y) * last);
}

// Where along a ray a box lies: brings its begin and end closer to and farther from the ray's own.
void rtgi_box_span(mat4 unit_from_world, vec3 origin, vec3 direction, float length_, inout float first, inout float last) {
	vec3 start = (unit_from_world * vec4(origin, 1.0)).xyz;
	vec3 along = (unit_from_world * vec4(direction, 0.0)).xyz;
	along = mix(along, vec3(1e-12), step(abs(along), vec3(1e-12)));
	vec3 low = -start / along;
	vec3 high = (1.0 - start) / along;
	vec3 nearest = min(low, high);
	vec3 farthest = max(low, high);
	float enter = max(max(nearest.x, max(nearest.y, nearest.z)), 0.0);
	float leave = min(min(farthest.x, min(farthest.y, farthest.z)), length_);
	if (leave > enter) {
		first = min(first, enter);
		last = max(last, leave);
	}
}
