// Media along mirrored rays up to what these meet, in even steps asked at one point each; needs include/media.glsl.

#define MIRROR_STEPS 8

// Where along the ray, up to `distance`, any medium is; false where none is.
bool mirror_span(vec3 origin, vec3 direction, float distance, out float begin, out float end)
{
  begin = distance;
  end = 0.0;
  for (int medium = 0; medium < passed.media; medium++) {
    vec2 span = medium_span(medium, origin, direction, distance);
    if (span.y > span.x) {
      begin = min(begin, span.x);
      end = max(end, span.y);
    }
  }
  return end > begin;
}

// (1 - e^-t)/t, the share that a step of that depth lets out of what it sends.
vec3 mirror_share(vec3 depth)
{
  vec3 thin = 1.0 - depth * (0.5 - depth / 6.0);
  vec3 thick = (1.0 - exp(-depth)) / max(depth, vec3(1e-20));
  return mix(thick, thin, vec3(lessThan(depth, vec3(1e-2))));
}
