
// Extinction [1/m] at a point, and the radiance a metre [W/(sr m^3)] that media give and scatter there of the ambient light.
// A shader that defines RTGI_MEDIA_LAMPS as a function of its own (vec3 of point and direction: the radiance that lamps send there,
// times phase function and shadow) has that scattered as well.
void rtgi_media_at(vec3 point, vec3 direction, out vec3 extinction, out vec3 given) {
	extinction = rtgi_media_extinction;
	given = rtgi_media_emission;
	vec3 scattered0 = rtgi_media_scattering[0];
	vec3 scattered1 = rtgi_media_scattering[1];
	vec3 scattered2 = rtgi_media_scattering[2];
@MEDIA@	vec3 band0;
	vec3 band1;
	vec3 band2;
	rtgi_ambient_bands(rtgi_media_ambient, rtgi_media_ambient_size, (rtgi_media_ambient_from_world * vec4(point, 1.0)).xyz,
			rtgi_media_turn * direction, band0, band1, band2);
	given += max(scattered0 * band0 + scattered1 * band1 + scattered2 * band2, vec3(0.0));
#ifdef RTGI_MEDIA_LAMPS
	given += scattered0 * RTGI_MEDIA_LAMPS(point, direction);
#endif
}

// Along a ray of some length with a unit direction, in equal steps: the share of light that is left (transmittance), and what media
// add. A jitter other than 0.5, from 0 to 1 and another in every pixel, trades bands for noise.
void rtgi_media_march(vec3 origin, vec3 direction, float length_, int steps, float jitter, out vec3 left, out vec3 gained) {
	float first = length_;
	float last = 0.0;
	if (rtgi_media_everywhere) {
		first = 0.0;
		last = length_;
	} else {
@SPANS@	}
	float stride = max(last - first, 0.0) / float(steps);
	left = vec3(1.0);
	gained = vec3(0.0);
	if (stride <= 0.0) {
		return;
	}
	for (int number = 0; number < steps; number++) {
		vec3 extinction;
		vec3 given;
		rtgi_media_at(origin + direction * (first + stride * (float(number) + jitter)), direction, extinction, given);
		vec3 depth = extinction * stride;
		gained += left * given * rtgi_slice_share(depth) * stride;
		left *= exp(-depth);
	}
}
