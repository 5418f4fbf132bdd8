// What a lamp's nodes make of its light at a distance: transport/lights/profile.py, of_distance. One texel stands for no change.

vec3 profile_of_distance(float way)
{
  int count = textureSize(lamp_distances, 0).x;
  if (count == 1) {
    return vec3(1.0);
  }
  float at = log(max(way, PROFILE_NEAREST) / PROFILE_NEAREST) * float(count - 1) / PROFILE_RANGE;
  at = clamp(at, 0.0, float(count - 1));
  int low = min(int(at), count - 2);
  return mix(texelFetch(lamp_distances, ivec2(low, 0), 0).rgb, texelFetch(lamp_distances, ivec2(low + 1, 0), 0).rgb, at - float(low));
}
