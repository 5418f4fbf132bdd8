// What a lamp's point sees of a surface, from a map of depths along the view.

// The depth at which the plane of the surface meets the ray through a place of the map: a flat surface never shades itself, however
// steeply it is seen.
float plane_depth(vec3 point, vec3 normal, vec2 ndc)
{
  vec3 across = ndc.x * shadow.ray_x + ndc.y * shadow.ray_y;
  vec3 origin = shadow.position_world + (shadow.orthographic != 0 ? shadow.ray_base + across : vec3(0.0));
  vec3 ray = shadow.orthographic != 0 ? shadow.forward_world : shadow.ray_base + across;
  float slope = dot(normal, ray);
  return abs(slope) > 1e-6 ? dot(normal, point - origin) / slope : 1e30;
}

// Share of the light that arrives at `point` with the surface's own `normal`; negative where this map does not show the point.
float shadow_visibility(vec3 point, vec3 normal)
{
  vec4 clip = shadow.clip_from_world * vec4(point, 1.0);
  vec2 ndc = clip.xy / max(clip.w, 1e-20);
  if (clip.w <= 0.0 || any(greaterThan(abs(ndc), vec2(1.0)))) {
    return shadow.outside_lit != 0 ? 1.0 : -1.0;
  }
  float depth = dot(point - shadow.position_world, shadow.forward_world);
  float margin = shadow.texel * (shadow.orthographic != 0 ? 1.0 : depth) + 1e-5 * abs(depth);
  ivec2 size = textureSize(shadow_map, 0);
  vec2 place = (0.5 * ndc + 0.5) * vec2(size) - 0.5;
  vec2 f = place - floor(place);
  float visible = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    ivec2 step = ivec2(corner & 1, corner >> 1);
    ivec2 texel = clamp(ivec2(floor(place)) + step, ivec2(0), size - 1);
    float nearest = texelFetch(shadow_map, texel, 0).r;
    float own = min(depth, plane_depth(point, normal, (vec2(texel) + 0.5) / vec2(size) * 2.0 - 1.0));
    vec2 along = mix(1.0 - f, f, vec2(step));
    visible += nearest == 0.0 || nearest >= own - margin ? along.x * along.y : 0.0;
  }
  return visible;
}
