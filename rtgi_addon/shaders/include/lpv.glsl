// Irradiance from an accumulated light propagation volume (techniques/lpv/gather.py, which derives it). Positions are in cells from
// the volume's corner: cell i reaches from i to i + 1.
#include "include/standing.glsl"

// Where a volume's light stands in textures of a colour channel each, and what takes coefficients 0 and 1 to 3 to irradiance.
struct LpvVolume {
  ivec3 resolution;
  int columns;
  ivec2 first_texel;
  float total;
  float along;
  // How far in front of a surface its light is taken, in cells.
  float surface_cells;
  bool dampening;
};

struct LpvCell {
  vec4 red;
  vec4 green;
  vec4 blue;
};

// Trilinear between cells' centres, of those before the plane through `base` with `normal`, as far as no walls stand before them.
LpvCell lpv_sample(LpvVolume volume, vec3 cells, vec3 base, vec3 normal)
{
  ivec3 last = volume.resolution - 1;
  vec3 position = clamp(cells - 0.5, vec3(0.0), vec3(last));
  ivec3 low = min(ivec3(floor(position)), max(last - 1, ivec3(0)));
  vec3 fraction = position - vec3(low);
  Walls around = Walls(volume.resolution, volume.columns, volume.first_texel);
  ivec3 standing = standing_cell(walls, around, low, fraction, base, normal);
  float total = 0.0;
  LpvCell result;
  result.red = vec4(0.0);
  result.green = vec4(0.0);
  result.blue = vec4(0.0);
  for (int corner = 0; corner < 8; corner++) {
    ivec3 cell = min(low + eighth(corner), last);
    if (height_of(cell, base, normal) <= BEFORE_CELLS) {
      continue;
    }
    float weight = trilinear_weight(eighth(corner), fraction) * open_way(walls, around, standing, cell);
    if (cell == standing) {
      weight += LEAST_SHARE;
    }
    ivec2 texel = volume.first_texel + atlas_texel(cell, volume.resolution, volume.columns);
    total += weight;
    result.red += weight * texelFetch(light_red, texel, 0);
    result.green += weight * texelFetch(light_green, texel, 0);
    result.blue += weight * texelFetch(light_blue, texel, 0);
  }
  float scale = 1.0 / max(total, 1e-6);
  result.red *= scale;
  result.green *= scale;
  result.blue *= scale;
  return result;
}

// Irradiance of the light that stands `distance` cells in front of the surface.
vec3 lpv_irradiance_at(LpvVolume volume, vec3 base, vec3 normal, float distance)
{
  LpvCell cell = lpv_sample(volume, base + distance * normal, base, normal);
  vec3 total = volume.total * vec3(cell.red.x, cell.green.x, cell.blue.x);
  // Coefficients stand in the order 1, y, z, x.
  vec3 away = volume.along * vec3(dot(cell.red.yzw, normal.yzx), dot(cell.green.yzw, normal.yzx), dot(cell.blue.yzw, normal.yzx));
  return max(total - away, 0.0);
}

vec3 lpv_irradiance(LpvVolume volume, vec3 base, vec3 normal)
{
  vec3 irradiance = lpv_irradiance_at(volume, base, normal, volume.surface_cells);
  if (volume.dampening) {
    vec3 farther = lpv_irradiance_at(volume, base, normal, volume.surface_cells + 1.0);
    vec3 ratio = min(farther / max(irradiance, 1e-30), 1.0);
    irradiance *= ratio * ratio;
  }
  return irradiance;
}
