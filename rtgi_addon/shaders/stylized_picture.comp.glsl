// The styled picture: surfaces, ink, grading, and lines over all (effects/stylized).
#include "include/stylized.glsl"
#include "include/stylized_left.glsl"
#include "include/stylized_tone.glsl"
#include "include/stylized_ink.glsl"

const float MIDDLE_GREY = 0.18;

// `lamps` is their irradiance over the key light's.
float rim_share(ivec2 texel, float lamps)
{
  vec3 towards = frame.orthographic != 0 ? -frame.forward_world : frame.position_world - surface_position(texel);
  float cosine = dot(surface_normal(texel), towards) / max(length(towards), TINY);
  float share = 1.0 - smooth_step((cosine - effect.rim_width) / max(effect.rim_softness, 1e-6) + 0.5);
  return share * (1.0 + (min(lamps, 1.0) - 1.0) * effect.rim_light) * effect.rim_strength;
}

// What is added to a surface as it was lit.
vec3 restyled(ivec2 texel, float tone)
{
  vec3 albedo = texelFetch(gbuffer_albedo, texel, 0).rgb;
  vec4 direct = texelFetch(direct_radiance, texel, 0);
  vec3 irradiance = texelFetch(indirect_irradiance, texel, 0).rgb;
  vec3 emission = texelFetch(gbuffer_emission, texel, 0).rgb;
  vec3 lit = direct.rgb + albedo * irradiance * INVERSE_PI + emission;
  vec3 styled = effect.paper_color;
  if (effect.shading != SHADING_PAPER) {
    vec3 below = albedo * (direct.w * INVERSE_PI);
    float shine = shine_of(direct.rgb, below);
    vec3 colour = direct.rgb / max(below + shine, vec3(TINY));
    vec3 total = colour * direct.w + saturated(irradiance, effect.bleeding);
    styled = albedo * INVERSE_PI * shaded(total, tone, tone_change(texel, tone)) + colour * highlight(shine) + emission;
  }
  if (effect.rim_strength > 0.0) {
    styled += effect.rim_color * rim_share(texel, direct.w / effect.key);
  }
  return styled - lit;
}

vec3 graded(vec3 colour)
{
  if (effect.contrast != 1.0) {
    colour *= pow(max(luminance(colour), 1e-12) / MIDDLE_GREY, effect.contrast - 1.0);
  }
  return saturated(colour, effect.saturation) * effect.tint;
}

// How far the pixel is inside the line it is deepest in, and whose that is.
vec2 deepest_line(ivec2 texel)
{
  vec2 found = vec2(-1.0, 0.0);
  for (int axis = 1; axis >= 0; --axis) {
    for (int dy = -effect.reach; dy <= effect.reach + 1 - axis; ++dy) {
      for (int dx = -effect.reach; dx <= effect.reach + axis; ++dx) {
        ivec2 base = texel - ivec2(dx, dy);
        if (!in_picture(base)) {
          continue;
        }
        vec4 both = texelFetch(borders, base, 0);
        vec2 line = axis == 1 ? both.xy : both.zw;
        if (line.x > 0.0) {
          float inside = line.x - length(vec2(dx, dy) - (axis == 1 ? vec2(0.5, 0.0) : vec2(0.0, 0.5)));
          if (inside > -0.5 && inside > found.x) {
            found = vec2(inside, line.y);
          }
        }
      }
    }
  }
  if (effect.has_marked != 0) {
    vec4 line = texelFetch(marked, texel, 0);
    if (line.z > 0.0 && line.x > found.x) {
      found = line.xy;
    }
  }
  return found;
}

vec4 styled_pixel(ivec2 texel, vec4 lit)
{
  vec4 picture = lit;
  if (effect_seen(texel)) {
    float tone = tone_at(texel);
    vec3 left = left_at(texel);
    if (effect.changes_surfaces != 0) {
      picture.rgb = max(picture.rgb + left * restyled(texel, tone), vec3(0.0));
    }
    if (effect.pattern != 0) {
      vec3 share = left * (ink(texel, 1.0 - min(tone / effect.pattern_tone, 1.0)) * effect.pattern_strength);
      picture.rgb += (effect.pattern_color - picture.rgb) * share;
    }
  }
  else if (effect.paper_background != 0) {
    picture = vec4(effect.paper_color, 1.0);
  }
  if (effect.changes_colours != 0) {
    picture.rgb = graded(picture.rgb);
  }
  if (effect.lines != 0) {
    vec2 line = deepest_line(texel);
    vec4 colour = list_texel(materials, int(line.y), MATERIAL_TEXELS, 0);
    picture = mix(picture, vec4(colour.rgb, 1.0), clamp(line.x + 0.5, 0.0, 1.0) * colour.a);
  }
  return mix(lit, picture, effect.strength);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(texel, frame.size))) {
    imageStore(result, texel, styled_pixel(texel, texelFetch(light, texel, 0)));
  }
}
