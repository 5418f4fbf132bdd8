// Light of a probe from its table and from what light there is, on any GPU. Before this stand the functions of places and distances
// (probe_weights.glsl, for its numbers) and two that each engine has for itself:
//   vec4 rtgi_table(int column, ivec3 probe, int texel)   // seven texels a column: nine coefficients, and what is seen of a sun
//   vec4 rtgi_entry(int row, int texel)                   // what shines, see rtgi_relit
// exchange/engines/transfer.py says what the columns are.

// Where linear . n + values . (n * n) over unit vectors n is least: what the first term is there, and the sum. By the dual of this
// problem, which has no gap, and Newton's steps after J. More and D. Sorensen, "Computing a Trust Region Step", 1983.
vec2 rtgi_least(vec3 linear, vec3 values) {
	vec3 line = 0.5 * linear;
	vec3 least = abs(line) - values;
	float low = max(least.x, max(least.y, least.z));
	float shift = low;
	for (int step = 0; step < 8; step++) {
		vec3 gap = max(values + shift, vec3(1e-30));
		vec3 part = line / gap;
		float square = dot(part, part);
		float slope = dot(part * part, 1.0 / gap);
		if (slope > 0.0) {
			shift = max(low, shift + (sqrt(square) - 1.0) * square / slope);
		}
	}
	float half_first = dot(line, line / max(values + shift, vec3(1e-30)));
	return vec2(-2.0 * half_first, -shift - half_first);
}

// One of Jacobi's rotations: of the elements pp, qq and pq of a symmetric matrix, of those of the third axis, and of a vector.
void rtgi_rotate(inout float pp, inout float qq, inout float pq, inout float rp, inout float rq, inout float p, inout float q) {
	if (abs(pq) <= 1e-12 * (abs(pp) + abs(qq))) {
		return;
	}
	float ratio = (qq - pp) / (2.0 * pq);
	float t = (ratio < 0.0 ? -1.0 : 1.0) / (abs(ratio) + sqrt(ratio * ratio + 1.0));
	float c = 1.0 / sqrt(t * t + 1.0);
	float s = t * c;
	pp -= t * pq;
	qq += t * pq;
	pq = 0.0;
	float before = rp;
	rp = c * before - s * rq;
	rq = s * before + c * rq;
	before = p;
	p = c * before - s * q;
	q = s * before + c * q;
}

// The irradiance of a colour's bands 1 (y, z, x) and 2 (xy, yz, 3z^2-1, xz and x^2-y^2) in the axes in which the second is diagonal.
void rtgi_axes(vec3 first, vec4 second, float ninth, out vec3 linear, out vec3 values) {
	float zonal = RTGI_COSINE_2_ZONAL * second.z;
	float across = 0.5 * RTGI_COSINE_2 * ninth;
	float xx = across - zonal;
	float yy = -across - zonal;
	float zz = 2.0 * zonal;
	float xy = 0.5 * RTGI_COSINE_2 * second.x;
	float yz = 0.5 * RTGI_COSINE_2 * second.y;
	float xz = 0.5 * RTGI_COSINE_2 * second.w;
	float x = RTGI_COSINE_1 * first.z;
	float y = RTGI_COSINE_1 * first.x;
	float z = RTGI_COSINE_1 * first.y;
	for (int sweep = 0; sweep < 4; sweep++) {
		rtgi_rotate(xx, yy, xy, xz, yz, x, y);
		rtgi_rotate(xx, zz, xz, xy, yz, x, z);
		rtgi_rotate(yy, zz, yz, xy, xz, y, z);
	}
	linear = vec3(x, y, z);
	values = vec3(xx, yy, zz);
}

// How far bands 1 and 2, scaled along a ray of shares, reach until irradiance is 0 in some direction and colour, and what of it is
// band 1 and band 2 there.
vec3 rtgi_border(vec2 ray, vec3 mean, mat3 linear, mat3 values) {
	vec3 border = vec3(1e30, 0.0, 0.0);
	for (int colour = 0; colour < 3; colour++) {
		vec2 least = rtgi_least(ray.x * linear[colour], ray.y * values[colour]);
		float reach = least.y < 0.0 ? mean[colour] / -least.y : 1e30;
		if (reach < border.x) {
			border = vec3(reach, least.x, least.y - least.x);
		}
	}
	return border;
}

// Scales a probe's bands 1 and 2 by the shares nearest to 1 that leave no negative irradiance, as the bake's own look-up does when it
// opens a bundle (techniques/lattice/reconstruction.py says why these are found so, _nearest_shares).
void rtgi_dering(inout vec3 c0, inout vec3 c1, inout vec3 c2, inout vec3 c3, inout vec3 c4, inout vec3 c5, inout vec3 c6,
		inout vec3 c7, inout vec3 c8) {
	vec3 lit = vec3(c0.x > 0.0 ? 1.0 : 0.0, c0.y > 0.0 ? 1.0 : 0.0, c0.z > 0.0 ? 1.0 : 0.0);
	c1 *= lit;
	c2 *= lit;
	c3 *= lit;
	c4 *= lit;
	c5 *= lit;
	c6 *= lit;
	c7 *= lit;
	c8 *= lit;
	vec3 mean = RTGI_COSINE_0 * lit * c0;
	// Most probes are seen not to ring by the norms of their bands.
	vec3 most = RTGI_COSINE_1 * sqrt(c1 * c1 + c2 * c2 + c3 * c3)
			+ 2.0 * RTGI_COSINE_2_ZONAL * sqrt(c4 * c4 + c5 * c5 + c6 * c6 + c7 * c7 + c8 * c8);
	if (most.x <= mean.x && most.y <= mean.y && most.z <= mean.z) {
		return;
	}
	vec3 linear_r;
	vec3 linear_g;
	vec3 linear_b;
	vec3 values_r;
	vec3 values_g;
	vec3 values_b;
	rtgi_axes(vec3(c1.x, c2.x, c3.x), vec4(c4.x, c5.x, c6.x, c7.x), c8.x, linear_r, values_r);
	rtgi_axes(vec3(c1.y, c2.y, c3.y), vec4(c4.y, c5.y, c6.y, c7.y), c8.y, linear_g, values_g);
	rtgi_axes(vec3(c1.z, c2.z, c3.z), vec4(c4.z, c5.z, c6.z, c7.z), c8.z, linear_b, values_b);
	mat3 linear = mat3(linear_r, linear_g, linear_b);
	mat3 values = mat3(values_r, values_g, values_b);
	if (rtgi_border(vec2(1.0), mean, linear, values).x >= 1.0) {
		return;
	}
	// By the squares of A1 / A0 and A2 / A0.
	vec2 power = vec2(4.0 / 9.0 * (dot(c1, c1) + dot(c2, c2) + dot(c3, c3)),
			1.0 / 16.0 * (dot(c4, c4) + dot(c5, c5) + dot(c6, c6) + dot(c7, c7) + dot(c8, c8)));
	power += 1e-6 * (power.x + power.y);
	float low = 0.0;
	float high = 1.0;
	vec2 shares = vec2(0.0);
	for (int bisection = 0; bisection < 21; bisection++) {
		float turn = 0.5 * (low + high);
		vec2 ray = vec2(1.0 - turn, turn);
		vec3 border = rtgi_border(ray, mean, linear, values);
		float nearest = dot(power, ray) / dot(power, ray * ray);
		float edge = 1.0 / max(ray.x, ray.y);
		float reach = min(min(border.x, nearest), edge);
		shares = reach * ray;
		vec2 grows = border.yz / max(ray, vec2(1e-30));
		if (reach < border.x) {
			grows = reach < edge ? -ray : (turn < 0.5 ? vec2(-1.0, 0.0) : vec2(0.0, -1.0));
		}
		vec2 left = power * (1.0 - shares);
		if (left.x * grows.y > left.y * grows.x) {
			low = turn;
		} else {
			high = turn;
		}
	}
	c1 *= shares.x;
	c2 *= shares.x;
	c3 *= shares.x;
	c4 *= shares.y;
	c5 *= shares.y;
	c6 *= shares.y;
	c7 *= shares.y;
	c8 *= shares.y;
}

// The nine coefficients of a probe, deringed, under `count` entries of three texels each: (column, light in r, g, b); what of that is
// also seen as a sun (r, g, b, -); and that sun's direction (x, y, z, -).
void rtgi_relit(ivec3 probe, int count, out vec3 c0, out vec3 c1, out vec3 c2, out vec3 c3, out vec3 c4, out vec3 c5, out vec3 c6,
		out vec3 c7, out vec3 c8) {
	c0 = vec3(0.0);
	c1 = vec3(0.0);
	c2 = vec3(0.0);
	c3 = vec3(0.0);
	c4 = vec3(0.0);
	c5 = vec3(0.0);
	c6 = vec3(0.0);
	c7 = vec3(0.0);
	c8 = vec3(0.0);
	for (int row = 0; row < count; row++) {
		vec4 entry = rtgi_entry(row, 0);
		int column = int(entry.x);
		vec3 light = entry.yzw;
		vec4 t0 = rtgi_table(column, probe, 0);
		vec4 t1 = rtgi_table(column, probe, 1);
		vec4 t2 = rtgi_table(column, probe, 2);
		vec4 t3 = rtgi_table(column, probe, 3);
		vec4 t4 = rtgi_table(column, probe, 4);
		vec4 t5 = rtgi_table(column, probe, 5);
		vec4 t6 = rtgi_table(column, probe, 6);
		c0 += light * t0.xyz;
		c1 += light * vec3(t0.w, t1.xy);
		c2 += light * vec3(t1.zw, t2.x);
		c3 += light * t2.yzw;
		c4 += light * t3.xyz;
		c5 += light * vec3(t3.w, t4.xy);
		c6 += light * vec3(t4.zw, t5.x);
		c7 += light * t5.yzw;
		c8 += light * t6.xyz;
		vec3 sun = t6.w * rtgi_entry(row, 1).xyz;
		if (sun.x != 0.0 || sun.y != 0.0 || sun.z != 0.0) {
			vec3 n = rtgi_entry(row, 2).xyz;
			c0 += 0.28209479 * sun;
			c1 += 0.48860251 * n.y * sun;
			c2 += 0.48860251 * n.z * sun;
			c3 += 0.48860251 * n.x * sun;
			c4 += 1.09254843 * n.x * n.y * sun;
			c5 += 1.09254843 * n.y * n.z * sun;
			c6 += 0.31539157 * (3.0 * n.z * n.z - 1.0) * sun;
			c7 += 1.09254843 * n.x * n.z * sun;
			c8 += 0.54627422 * (n.x + n.y) * (n.x - n.y) * sun;
		}
	}
	rtgi_dering(c0, c1, c2, c3, c4, c5, c6, c7, c8);
}
