// Irradiance from an accumulated light propagation volume (techniques/lpv/gather.py, which derives it). Positions are in cells from
// the volume's corner: cell i reaches from i to i + 1.
#include "include/volume.glsl"

struct LpvCell {
  vec4 red;
  vec4 green;
  vec4 blue;
};

LpvCell lpv_sample(vec3 cells, ivec3 resolution, int columns)
{
  vec3 position = clamp(cells - 0.5, vec3(0.0), vec3(resolution - 1));
  ivec3 low = min(ivec3(floor(position)), max(resolution - 2, ivec3(0)));
  vec3 f = position - vec3(low);
  LpvCell result;
  result.red = vec4(0.0);
  result.green = vec4(0.0);
  result.blue = vec4(0.0);
  for (int corner = 0; corner < 8; corner++) {
    ivec3 step = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    vec3 along = mix(1.0 - f, f, vec3(step));
    float weight = along.x * along.y * along.z;
    ivec2 texel = atlas_texel(min(low + step, resolution - 1), resolution, columns);
    result.red += weight * texelFetch(light_red, texel, 0);
    result.green += weight * texelFetch(light_green, texel, 0);
    result.blue += weight * texelFetch(light_blue, texel, 0);
  }
  return result;
}

// The constant part of intensity, and the linear part along the normal.
void lpv_towards(LpvCell cell, vec3 normal, out vec3 total, out vec3 away)
{
  const float y0 = 0.28209479;
  const float y1 = 0.48860251;
  total = y0 * vec3(cell.red.x, cell.green.x, cell.blue.x);
  // Coefficients stand in the order 1, y, z, x.
  away = y1 * vec3(dot(cell.red.yzw, normal.yzx), dot(cell.green.yzw, normal.yzx), dot(cell.blue.yzw, normal.yzx));
}

vec3 lpv_irradiance(vec3 cells, vec3 normal)
{
  vec3 first = cells + 0.5 * normal;
  vec3 total, away;
  lpv_towards(lpv_sample(first, parameters.resolution, parameters.columns), normal, total, away);
  vec3 result = parameters.face_total * total - parameters.face_ahead * away;
  if (parameters.dampening != 0) {
    vec3 unused, farther;
    lpv_towards(lpv_sample(first + normal, parameters.resolution, parameters.columns), normal, unused, farther);
    result += (parameters.face_ahead - 0.5 * parameters.face_total) * max(away - max(farther, 0.0), 0.0);
  }
  return max(result * parameters.inverse_area, 0.0);
}
