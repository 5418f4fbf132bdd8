// Where lines are: half their width and whose they are, to the right of and above every pixel (effects/stylized/edges.py).
#include "include/stylized.glsl"
#include "include/stylized_left.glsl"

#define DEPTH_PLANE 0
#define DEPTH_INVERSE 1
#define DEPTH_GRADIENT 2
#define NORMAL_ANGLE 0
#define NORMAL_COMPONENTS 1
#define CURVATURE_NONE 0
#define CURVATURE_RIDGES 1
#define CURVATURE_VALLEYS 2
#define CURVATURE_BOTH 3

const float UNKNOWN = 1e30;

float flat_depth(ivec2 texel)
{
  return frame.orthographic != 0 ? effect_depth(texel) : 1.0 / effect_depth(texel);
}

float second_difference(ivec2 texel, ivec2 along)
{
  ivec2 before = texel - along;
  ivec2 after = texel + along;
  if (!in_picture(before) || !in_picture(after) || !effect_seen(before) || !effect_seen(after)) {
    return UNKNOWN;
  }
  return abs(flat_depth(before) - 2.0 * flat_depth(texel) + flat_depth(after));
}

float depth_step(ivec2 here, ivec2 there, ivec2 along)
{
  if (effect.depth_edges == DEPTH_PLANE) {
    vec3 way = surface_position(there) - surface_position(here);
    return max(abs(dot(texelFetch(gbuffer_geometry, here, 0).xyz, way)), abs(dot(texelFetch(gbuffer_geometry, there, 0).xyz, way)));
  }
  if (effect.depth_edges == DEPTH_GRADIENT) {
    return abs(effect_depth(there) - effect_depth(here));
  }
  float second = min(second_difference(here, along), second_difference(there, along));
  if (second == UNKNOWN) {
    return 0.0;
  }
  return frame.orthographic != 0 ? second : second * effect_depth(here) * effect_depth(there);
}

// How the normal turns over a pixel: to the right, upwards, and the mixed one (effects/stylized/curvature.py).
vec3 turning(ivec2 texel)
{
  if (!in_picture(texel) || !effect_seen(texel)) {
    return vec3(0.0);
  }
  int instance = effect_instance(texel);
  vec2 changes[2];
  for (int axis = 0; axis < 2; ++axis) {
    ivec2 along = axis == 0 ? ivec2(1, 0) : ivec2(0, 1);
    ivec2 before = texel - along;
    ivec2 after = texel + along;
    if (!in_picture(before) || !in_picture(after) || effect_instance(before) != instance || effect_instance(after) != instance) {
      return vec3(0.0);
    }
    vec3 change = 0.5 * (surface_normal(after) - surface_normal(before));
    changes[axis] = vec2(dot(change, effect.right_world), dot(change, effect.up_world));
  }
  return vec3(changes[0].x, changes[1].y, 0.5 * (changes[0].y + changes[1].x));
}

// The bend between a pixel and the next, 0 where it is none of a line: positive for ridges, negative for valleys.
float bend_at(ivec2 here, ivec2 along, out float ahead, out float aside)
{
  ivec2 there = here + along;
  ahead = aside = 0.0;
  if (!in_picture(here) || !in_picture(there) || effect_instance(here) != effect_instance(there)) {
    return 0.0;
  }
  vec3 mean = 0.5 * (turning(here) + turning(there));
  ahead = along.x == 1 ? mean.x : mean.y;
  aside = along.x == 1 ? mean.y : mean.x;
  float bend = mean.x + mean.y;
  float apart = mean.x - mean.y;
  if (sqrt(apart * apart + 4.0 * mean.z * mean.z) < CURVATURE_ONE_WAY * abs(bend)) {
    return 0.0;
  }
  bool ridges = effect.curvature_edges == CURVATURE_RIDGES || effect.curvature_edges == CURVATURE_BOTH;
  bool valleys = effect.curvature_edges == CURVATURE_VALLEYS || effect.curvature_edges == CURVATURE_BOTH;
  return (ridges && bend > effect.curvature_radians) || (valleys && bend < -effect.curvature_radians) ? bend : 0.0;
}

// What of the bend lies on one side of a border; -1 for one too wide to be a line.
float bend_beyond(ivec2 here, ivec2 along, int way, float own)
{
  float total = 0.0;
  float ahead, aside;
  for (int k = 1; k <= CURVATURE_REACH + 1; ++k) {
    float bend = bend_at(here + way * k * along, along, ahead, aside);
    if (bend * own <= 0.0) {
      return total;
    }
    total += abs(bend);
  }
  return -1.0;
}

// Whether half of a bend is behind this border.
bool is_bent(ivec2 here, ivec2 along)
{
  float ahead, aside;
  float own = bend_at(here, along, ahead, aside);
  if (own == 0.0 || abs(ahead) < CURVATURE_ALONG * abs(aside)) {
    return false;
  }
  float before = bend_beyond(here, along, -1, own);
  float after = before < 0.0 ? -1.0 : bend_beyond(here, along, 1, own);
  float middle = CURVATURE_HALF * (before + after + abs(own));
  return after >= 0.0 && before < middle && before + abs(own) >= middle;
}

bool is_border(ivec2 here, ivec2 there, ivec2 along, float nearest)
{
  bool both = effect_seen(here) && effect_seen(there);
  if (!both) {
    return effect.object_edges != 0 && effect_seen(here) != effect_seen(there);
  }
  bool same_object = effect_instance(here) == effect_instance(there);
  if ((effect.object_edges != 0 && !same_object) ||
      (effect.material_edges != 0 && effect_material(here) != effect_material(there))) {
    return true;
  }
  if (effect.depth_edges <= DEPTH_GRADIENT &&
      depth_step(here, there, along) > effect.depth_threshold * footprint_at(nearest)) {
    return true;
  }
  vec3 one = surface_normal(here);
  vec3 other = surface_normal(there);
  if (effect.normal_edges == NORMAL_ANGLE && dot(one, other) < effect.crease_cosine) {
    return true;
  }
  vec3 change = abs(one - other);
  if (effect.normal_edges == NORMAL_COMPONENTS && max(change.x, max(change.y, change.z)) > effect.normal_threshold) {
    return true;
  }
  return effect.curvature_edges != CURVATURE_NONE && same_object && is_bent(here, along);
}

// Half the width of the line between two pixels side by side, 0 for none, and the material of the nearer.
vec2 border(ivec2 here, ivec2 along)
{
  ivec2 there = here + along;
  if (!in_picture(there) || !(effect_seen(here) || effect_seen(there))) {
    return vec2(0.0);
  }
  float depth = effect_depth(here);
  float other = effect_depth(there);
  float nearest = min(depth, other);
  if (!is_border(here, there, along, nearest)) {
    return vec2(0.0);
  }
  ivec2 owner = depth <= other ? here : there;
  int material = effect_material(owner);
  if (list_texel(instances, effect_instance(owner), INSTANCE_TEXELS, 4).x != 0.0 ||
      list_texel(materials, material, MATERIAL_TEXELS, 1).x != 0.0) {
    return vec2(0.0);
  }
  float width = effect.line_world_width > 0.0 ? effect.line_world_width / max(footprint_at(nearest), 1e-12) : effect.line_width;
  if (effect.line_thinning > 0.0) {
    width *= min(effect.line_thinning / max(nearest, 1e-12), 1.0);
  }
  float left = dot(left_at(owner), vec3(1.0 / 3.0));
  return vec2(0.5 * left * clamp(width, effect.line_least, effect.line_widest), float(material));
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(texel, frame.size))) {
    imageStore(borders, texel, vec4(border(texel, ivec2(1, 0)), border(texel, ivec2(0, 1))));
  }
}
