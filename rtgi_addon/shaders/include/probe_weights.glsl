// How much a probe counts at a point on a surface: the twin of RTGI's techniques/lattice/weights.py, which says why and has the numbers.
// In the GLSL that Blender, bare OpenGL, Godot and three.js have in common; none of it fetches, hosts do.

// Where the eight neighbours are looked for, from a point at offset from the volume's centre.
vec3 rtgi_lifted(vec3 offset, vec3 surface_normal, float bias)
{
  return offset + RTGI_LIFT * bias * surface_normal;
}

// The octahedral map's square coordinates, from -1 to 1, of a direction of any length, with the bake's axes (z up).
vec2 rtgi_octahedral(vec3 direction)
{
  vec2 xy = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
  vec2 folded = (1.0 - abs(xy.yx)) * vec2(xy.x < 0.0 ? -1.0 : 1.0, xy.y < 0.0 ? -1.0 : 1.0);
  return direction.z < 0.0 ? folded : xy;
}

// Where a bordered tile is read for the point at offset from its probe (the bake's axes), in texels; bias is the volume's.
vec2 rtgi_tile_position(vec3 offset, int tile, float bias)
{
  vec3 direction = length(offset) <= RTGI_AT_PROBE * bias ? vec3(0.0, 0.0, 1.0) : offset;
  return (rtgi_octahedral(direction) + 1.0) * (0.5 * float(tile)) + 0.5;
}

// How surely the probe sees a point at that distance, where its tile has (mean, mean square): the share beyond it, squared.
float rtgi_seen_share(float point_distance, vec2 moments)
{
  float behind = point_distance - moments.x;
  float variance = abs(moments.y - moments.x * moments.x);
  float share = 0.5 - 0.5 * behind / sqrt(max(variance + behind * behind, RTGI_TINY));
  return share * share;
}

// Probes behind the surface count little; one at the point itself counts in full.
float rtgi_side_weight(vec3 towards_probe, vec3 surface_normal)
{
  float way = length(towards_probe);
  float cosine = way > 0.0 ? dot(towards_probe, surface_normal) / max(way, RTGI_TINY) : 1.0;
  float wrapped = 0.5 * (cosine + 1.0);
  return wrapped * wrapped + RTGI_SIDE_FLOOR;
}

// Not yet divided by the sum over all eight; seen is the product of side weight and seen share.
float rtgi_probe_weight(float trilinear, float seen, bool live)
{
  float crushed = seen < RTGI_CRUSH_BELOW ? seen * seen * seen / (RTGI_CRUSH_BELOW * RTGI_CRUSH_BELOW) : seen;
  return trilinear * ((live ? crushed + RTGI_UNSEEN_FLOOR : 0.0) + RTGI_DILATED_FLOOR);
}

// The probe that a word of a scattered volume's node names (scene/scattered.py), and its share; a negative word stands in for probes
// that would see the node, which count before it.
int rtgi_word_probe(float word)
{
  return int(abs(word)) / int(RTGI_WORD);
}

float rtgi_word_share(float word)
{
  return float(int(abs(word)) % int(RTGI_WORD)) / float(RTGI_SHARES);
}

// 1 inside the volume, falling to 0 over its outermost cell.
float rtgi_coverage(vec3 lattice, vec3 resolution)
{
  vec3 depth = min(lattice + 0.5, resolution - 0.5 - lattice) / min(0.5 * resolution, vec3(1.0));
  return clamp(min(depth.x, min(depth.y, depth.z)), 0.0, 1.0);
}

// From lattice coordinates to the nearest ones of the volume's box, in cells.
vec3 rtgi_to_box(vec3 lattice, vec3 resolution)
{
  return clamp(lattice, vec3(-0.5), resolution - 0.5) - lattice;
}

// The basis 1, y, z, x | xy, yz, 3z^2 - 1, xz | x^2 - y^2, each times its band of the cosine lobe: irradiance from radiance.
void rtgi_cosine_basis(vec3 normal, out vec4 first, out vec4 second, out float ninth)
{
  first = vec4(RTGI_COSINE_0, RTGI_COSINE_1 * normal.y, RTGI_COSINE_1 * normal.z, RTGI_COSINE_1 * normal.x);
  second = vec4(RTGI_COSINE_2 * normal.x * normal.y, RTGI_COSINE_2 * normal.y * normal.z,
                RTGI_COSINE_2_ZONAL * (3.0 * normal.z * normal.z - 1.0), RTGI_COSINE_2 * normal.x * normal.z);
  ninth = 0.5 * RTGI_COSINE_2 * (normal.x + normal.y) * (normal.x - normal.y);
}
