// A texel of the light atlas from its table and from what light there is, on any GPU. Before this stand two functions:
//   vec4 rtgi_atlas_column(int column, ivec2 texel, int part)   // coefficients of red, green and blue, and of what is seen of a sun
//   vec4 rtgi_entry(int row, int texel)                          // what shines: (column, light in r, g, b), (seen as a sun r, g, b, -)

// The four coefficients of one channel under `count` entries.
vec4 rtgi_atlas_relit(ivec2 texel, int channel, int count) {
	vec4 total = vec4(0.0);
	for (int row = 0; row < count; row++) {
		vec4 entry = rtgi_entry(row, 0);
		int column = int(entry.x);
		total += entry[1 + channel] * rtgi_atlas_column(column, texel, channel);
		float seen = rtgi_entry(row, 1)[channel];
		if (seen != 0.0) {
			total += seen * rtgi_atlas_column(column, texel, 3);
		}
	}
	return total;
}
