// What sphere probes saw, looked up by direction and roughness: the twin of RTGI's effects/spheres/maps.py, which says why.
// In the GLSL that Blender, bare OpenGL, Godot and three.js have in common. Hosts bring, beside rtgi_octahedral of
// probe_weights.glsl: RTGI_SPHERES (how many), RTGI_SPHERE_SIDE (texels along a side of level 0), RTGI_SPHERE_LEVELS,
// RTGI_SPHERE_LEAST, rtgi_sphere_row(probe, row) of the table, rtgi_sphere_texel(probe, texel) of the maps, and
// rtgi_sphere_axes(direction), which turns a direction of the world into the maps' axes.
//
// Rows of the table: 0-2 those of the matrix that makes the influence volume the unit one, 3-5 those of the parallax volume; 6 the
// centre and 1/falloff; 7 whether influence and parallax are boxes.

vec3 rtgi_sphere_point(int probe, int row, vec4 point)
{
  return vec3(dot(rtgi_sphere_row(probe, row), point), dot(rtgi_sphere_row(probe, row + 1), point),
              dot(rtgi_sphere_row(probe, row + 2), point));
}

// 1 inside the influence, falling to 0 at its border.
float rtgi_sphere_influence(int probe, vec3 position)
{
  vec3 unit = rtgi_sphere_point(probe, 0, vec4(position, 1.0));
  vec3 size = abs(unit);
  float reach = rtgi_sphere_row(probe, 7).x > 0.5 ? max(size.x, max(size.y, size.z)) : length(unit);
  return clamp((1.0 - reach) * rtgi_sphere_row(probe, 6).w, 0.0, 1.0);
}

// From the probe's centre to where the ray leaves its parallax volume, and the width of the lobe as it is seen from there.
vec4 rtgi_sphere_parallax(int probe, vec3 position, vec3 direction, float alpha)
{
  vec3 start = rtgi_sphere_point(probe, 3, vec4(position, 1.0)), along = rtgi_sphere_point(probe, 3, vec4(direction, 0.0));
  float reach;
  bool met;
  if (rtgi_sphere_row(probe, 7).y > 0.5) {
    float near = -1e30;
    reach = 1e30;
    met = true;
    for (int axis = 0; axis < 3; axis++) {
      if (along[axis] == 0.0) {
        met = met && abs(start[axis]) <= 1.0;
      } else {
        float one = (-1.0 - start[axis]) / along[axis], other = (1.0 - start[axis]) / along[axis];
        near = max(near, min(one, other));
        reach = min(reach, max(one, other));
      }
    }
    met = met && near <= reach && reach > 0.0;
  } else {
    float a = dot(along, along), b = dot(start, along);
    float root = b * b - a * (dot(start, start) - 1.0);
    reach = (sqrt(max(root, 0.0)) - b) / a;
    met = root > 0.0 && reach > 0.0;
  }
  if (!met) {
    return vec4(direction, alpha);
  }
  vec3 towards = position + direction * reach - rtgi_sphere_row(probe, 6).xyz;
  float away = length(towards);
  return vec4(away > 1e-12 ? towards : direction, clamp(alpha * reach / max(away, 1e-12), 0.0, 1.0));
}

int rtgi_sphere_level_side(int level)
{
  return max(RTGI_SPHERE_SIDE >> max(level - 2, min(level, 1)), RTGI_SPHERE_LEAST);
}

vec3 rtgi_sphere_level(int probe, int level, vec3 direction)
{
  int row = 0;
  for (int below = 0; below < level; below++) {
    row += rtgi_sphere_level_side(below) + 2;
  }
  int side = rtgi_sphere_level_side(level);
  vec2 position = (rtgi_octahedral(rtgi_sphere_axes(direction)) + 1.0) * (0.5 * float(side)) + 0.5;
  ivec2 low = clamp(ivec2(position), ivec2(0), ivec2(side));
  vec2 f = position - vec2(low);
  low.y += row;
  vec3 first = mix(rtgi_sphere_texel(probe, low), rtgi_sphere_texel(probe, low + ivec2(1, 0)), f.x);
  vec3 second = mix(rtgi_sphere_texel(probe, low + ivec2(0, 1)), rtgi_sphere_texel(probe, low + ivec2(1, 1)), f.x);
  return mix(first, second, f.y);
}

// Radiance from `direction` at `position`, averaged by a lobe of alpha, times the share that the probes know of it (w): what is
// added is 1 - share of what there is without them.
vec4 rtgi_spheres(vec3 position, vec3 direction, float alpha)
{
  vec3 total = vec3(0.0);
  float left = 1.0;
  for (int probe = 0; probe < RTGI_SPHERES; probe++) {
    float share = left * rtgi_sphere_influence(probe, position);
    if (share > 0.0) {
      vec4 towards = rtgi_sphere_parallax(probe, position, direction, alpha);
      float level = clamp(log2(max(towards.w, 1e-12) * (0.5 * float(RTGI_SPHERE_SIDE))), 0.0, float(RTGI_SPHERE_LEVELS - 1));
      int low = min(int(level), RTGI_SPHERE_LEVELS - 2);
      total += share * mix(rtgi_sphere_level(probe, low, towards.xyz), rtgi_sphere_level(probe, low + 1, towards.xyz),
                           level - float(low));
      left -= share;
    }
  }
  return vec4(total, 1.0 - left);
}
