// Bands, ramps and highlights of a pixel's light (effects/stylized/tone.py, ramps.py, shading.py).

#define SHADING_AS_LIT 0
#define SHADING_BANDS 1
#define SHADING_RAMP 2
#define SHADING_PAPER 3
#define HIGHLIGHTS_AS_LIT 0
#define HIGHLIGHTS_BAND 1
#define HIGHLIGHTS_RAMP 2
#define RAMP_SIZE 64
#define PARTING_STEPS 5

const float TINY = 1e-20;
const float INVERSE_PI = 0.31830988618;

float smooth_step(float x)
{
  x = clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// `tone` in equal treads from 0 to 1, each as bright as its middle.
float banded(float tone, float width)
{
  if (effect.bands == 1) {
    return 0.5;
  }
  float bands = float(effect.bands);
  float place = tone * bands;
  float border = clamp(floor(place + 0.5), 1.0, bands - 1.0);
  width = clamp(width * bands, 1e-6, 1.0);
  return (border - 0.5 + smooth_step((place - border) / width + 0.5)) / bands;
}

float tone_at(ivec2 texel)
{
  return (texelFetch(direct_radiance, texel, 0).w + luminance(texelFetch(indirect_irradiance, texel, 0).rgb)) / effect.key;
}

// How much the tone changes over a pixel, among neighbours of the same object.
float tone_change(ivec2 texel, float tone)
{
  float change = 0.0;
  int instance = effect_instance(texel);
  for (int k = 0; k < 4; ++k) {
    ivec2 next = texel + ivec2(k == 0 ? 1 : k == 1 ? -1 : 0, k == 2 ? 1 : k == 3 ? -1 : 0);
    if (in_picture(next) && effect_instance(next) == instance) {
      change = max(change, abs(tone_at(next) - tone));
    }
  }
  return change;
}

vec3 ramp_colour(float tone)
{
  float place = clamp(tone, 0.0, 1.0) * float(RAMP_SIZE - 1);
  int low = min(int(place), RAMP_SIZE - 2);
  return mix(effect.ramp[low].rgb, effect.ramp[low + 1].rgb, place - float(low));
}

vec3 highlight_colour(float tone)
{
  float place = clamp(tone, 0.0, 1.0) * float(RAMP_SIZE - 1);
  int low = min(int(place), RAMP_SIZE - 2);
  return mix(effect.highlight_ramp[low].rgb, effect.highlight_ramp[low + 1].rgb, place - float(low));
}

vec3 saturated(vec3 colour, float amount)
{
  if (amount == 1.0) {
    return colour;
  }
  float grey = luminance(colour);
  return max(grey + (colour - grey) * amount, vec3(0.0));
}

// The luminance of the shine in direct = colour * (below + shine), the colour having luminance 1; by Newton's method from below.
float shine_of(vec3 direct, vec3 below)
{
  if (luminance(direct / max(below, vec3(TINY))) <= 1.001) {
    return 0.0;
  }
  vec3 least = direct * vec3(0.2126, 0.7152, 0.0722) - below;
  float shine = max(max(least.x, max(least.y, least.z)), 0.0);
  for (int k = 0; k < PARTING_STEPS; ++k) {
    vec3 under = max(below + shine, vec3(TINY));
    vec3 ratio = direct / under;
    shine += (luminance(ratio) - 1.0) / max(luminance(ratio / under), TINY);
  }
  return max(shine, 0.0);
}

vec3 shaded(vec3 total, float tone, float change)
{
  float width = change * effect.softness;
  float level = tone;
  if (effect.shading == SHADING_BANDS && effect.per_channel != 0) {
    vec3 share = total / effect.key;
    total = vec3(banded(share.r, width), banded(share.g, width), banded(share.b, width)) * effect.key;
    level = banded(tone, width);
  }
  else if (effect.shading != SHADING_AS_LIT) {
    float brightness = luminance(total);
    vec3 hue = brightness > 1e-12 ? total / max(brightness, TINY) : vec3(1.0);
    if (effect.shading == SHADING_BANDS) {
      level = banded(tone, width);
      total = hue * (level * effect.key);
    }
    else {
      total = ramp_colour(tone) * (1.0 + (hue - 1.0) * effect.ramp_tint) * effect.key;
    }
  }
  if (effect.shadow_amount > 0.0) {
    total += (effect.shadow_color * effect.key - total) * (effect.shadow_amount * (1.0 - clamp(level, 0.0, 1.0)));
  }
  return total;
}

vec3 highlight(float shine)
{
  if (effect.highlights == HIGHLIGHTS_AS_LIT) {
    return vec3(shine);
  }
  if (effect.highlights == HIGHLIGHTS_RAMP) {
    return shine > 0.0 ? highlight_colour(shine / effect.highlight_threshold) * effect.highlight_brightness : vec3(0.0);
  }
  if (effect.highlights != HIGHLIGHTS_BAND) {
    return vec3(0.0);
  }
  float width = max(effect.highlight_softness * effect.highlight_threshold, 1e-6);
  return vec3(smooth_step((shine - effect.highlight_threshold) / width + 0.5) * effect.highlight_brightness);
}
