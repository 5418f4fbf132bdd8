// Adds what media between a mirror and what it shows scatter of one lamp into its ray, as far as one of the lamp's shadow maps sees
// it (effects/media/along.py has the same by one point a ray).
#include "include/lamp.glsl"
#include "include/shadow.glsl"
#include "include/media.glsl"
#include "include/media_lamp.glsl"
#include "include/mirror_media.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec4 found = texelFetch(met, texel, 0);
  if (found.y <= 0.0) {
    return;
  }
  vec3 origin = texelFetch(gbuffer_position, texel, 0).xyz;
  vec3 direction = texelFetch(directions, texel, 0).xyz;
  float begin = 0.0;
  float end = 0.0;
  if (!mirror_span(origin, direction, found.x, begin, end)) {
    return;
  }
  float within = (end - begin) / float(MIRROR_STEPS);
  vec3 taken = vec3(0.0);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < MIRROR_STEPS; k++) {
    vec3 point = origin + direction * (begin + (float(k) + found.z) * within);
    vec3 extinction = vec3(0.0);
    for (int medium = 0; medium < passed.media; medium++) {
      Coefficients here = medium_there(medium, point);
      extinction += here.scattering + here.absorption;
    }
    vec3 left = exp(-taken) * mirror_share(extinction * within) * within;
    taken += extinction * within;
    LampLight light;
    vec3 arriving;
    if (extinction == vec3(0.0) || !media_arriving(passed.media, point, light, arriving)) {
      continue;
    }
    float cosine = dot(direction, light.direction);
    for (int medium = 0; medium < passed.media; medium++) {
      vec3 scattering = medium_there(medium, point).scattering;
      if (scattering != vec3(0.0)) {
        sum += left * arriving * scattering * medium_phase(medium, cosine);
      }
    }
  }
  vec4 weight = texelFetch(weights, texel, 0);
  imageStore(gathered, texel, imageLoad(gathered, texel) + vec4(found.y * weight.rgb * sum, 0.0));
}
