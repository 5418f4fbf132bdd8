// What is in the volume before a pixel's point (effects/media/integrate.py); needs include/froxels.glsl, slice_depth, slice_direct and
// gathered_depth.

#define MEDIA_NOWHERE 1e10

// Of the surface in a pixel from the eye.
float seen_distance(ivec2 texel)
{
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) == 0.0) {
    return MEDIA_NOWHERE;
  }
  vec3 towards = texelFetch(gbuffer_position, texel, 0).xyz - froxels.position_world;
  return froxels.orthographic != 0 ? dot(towards, froxels.forward_world) : length(towards);
}

// One of the four columns about a pixel, and how much it counts.
ivec2 column_about(ivec2 texel, int corner, out float weight)
{
  vec2 place = (vec2(texel) + 0.5) / float(froxels.tile) - froxels.jitter;
  vec2 low = floor(place);
  ivec2 bit = ivec2(corner & 1, corner >> 1);
  vec2 along = mix(1.0 - (place - low), place - low, vec2(bit));
  weight = along.x * along.y;
  return clamp(ivec2(low) + bit, ivec2(0), froxels.columns - 1);
}

int slice_at(float distance)
{
  return min(int(froxel_slice(distance)), froxels.slices - 1);
}

// Optical depth before a distance that lies in the slice with that texel, whose own is `tau`, and the part of it that lies before.
vec3 depth_before(ivec2 at, float distance, out vec3 tau, out float part)
{
  vec4 here = texelFetch(slice_depth, at, 0);
  tau = here.rgb;
  part = clamp((distance - here.w) / max(texelFetch(slice_direct, at, 0).w - here.w, 1e-12), 0.0, 1.0);
  return texelFetch(gathered_depth, at, 0).rgb + tau * part;
}
