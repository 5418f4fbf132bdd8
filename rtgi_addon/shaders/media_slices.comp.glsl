// What is in every slice of the volume before any lamp: optical depth, emission, light by the field's harmonics
// (effects/media/lighting.py). In the fourth channels: where in the slice media begin and end, and where it is asked.
#include "include/media.glsl"
#include "include/froxels.glsl"
#define AMBIENT froxels
#include "include/ambient.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  Froxel froxel = froxel_of(texel);
  if (texel.x >= froxels.columns.x * froxels.blocks || froxel.slice >= froxels.slices) {
    return;
  }
  vec3 origin;
  vec3 direction;
  froxel_ray(froxel.column, origin, direction);
  float low = froxel_limit(froxel.slice);
  float high = froxel_limit(froxel.slice + 1);
  vec2 hull = vec2(high, low);
  for (int medium = 0; medium < froxels.media; medium++) {
    vec2 span = medium_span(medium, origin, direction, high);
    span.x = max(span.x, low);
    if (medium_seen(medium) && span.y > span.x) {
      hull = vec2(min(hull.x, span.x), max(hull.y, span.y));
    }
  }
  vec3 depth = vec3(0.0);
  vec3 own = vec3(0.0);
  vec3 indirect = vec3(0.0);
  float along = hull.x;
  if (hull.y > hull.x) {
    along = hull.x + froxel_number(froxel, 0u) * (hull.y - hull.x);
    vec3 point = origin + direction * along;
    int around = -1;
    if (froxels.all_orders != 0) {
      around = ambient_point(point, vec3(froxel_number(froxel, 1u), froxel_number(froxel, 2u), froxel_number(froxel, 3u)));
    }
    for (int medium = 0; medium < froxels.media; medium++) {
      vec2 span = medium_span(medium, origin, direction, high);
      float within = span.y - max(span.x, low);
      if (!medium_seen(medium) || within <= 0.0) {
        continue;
      }
      Coefficients here = medium_at(medium, point);
      depth += (here.scattering + here.absorption) * within;
      own += here.emission * within;
      if (around >= 0 && here.scattering != vec3(0.0)) {
        indirect += here.scattering * within * ambient_scattered(around, direction, medium_texel(medium, 10).xyz);
      }
    }
  }
  imageStore(slice_depth, texel, vec4(depth, hull.x));
  imageStore(slice_direct, texel, vec4(own, max(hull.y, hull.x)));
  imageStore(slice_indirect, texel, vec4(indirect, along));
}
