// Where a ray meets what the picture shows (effects/screen_reflections/search.py has the same walks, and their sources).

struct ScreenRay {
  vec2 origin;
  vec2 along;
  // Depth over clip w, and one over clip w, at both ends.
  vec2 depths;
  vec2 inverse_w;
  float reach;
  float end;
};

struct ScreenHit {
  ivec2 pixel;
  float s;
  float behind;
};

float ray_depth(ScreenRay ray, float s)
{
  return mix(ray.depths.x, ray.depths.y, s) / mix(ray.inverse_w.x, ray.inverse_w.y, s);
}

ScreenRay screen_ray(vec3 point, vec3 direction)
{
  ScreenRay ray;
  float start = dot(point - frame.position_world, frame.forward_world), turn = dot(direction, frame.forward_world);
  ray.reach = mirrors.distance;
  if (turn < 0.0) {
    ray.reach = min(ray.reach, (mirrors.near - start) / turn * 0.999);
  }
  ray.reach = max(ray.reach, 0.0);
  vec4 one = frame.clip_from_world * vec4(point, 1.0), other = frame.clip_from_world * vec4(point + direction * ray.reach, 1.0);
  ray.inverse_w = 1.0 / max(vec2(one.w, other.w), 1e-12);
  ray.origin = (one.xy * ray.inverse_w.x * 0.5 + 0.5) * vec2(frame.size);
  ray.along = (other.xy * ray.inverse_w.y * 0.5 + 0.5) * vec2(frame.size) - ray.origin;
  ray.depths = vec2(start, start + turn * ray.reach) * ray.inverse_w;
  ray.end = 1.0;
  for (int axis = 0; axis < 2; axis++) {
    if (ray.along[axis] != 0.0) {
      float border = ray.along[axis] > 0.0 ? float(frame.size[axis]) : 0.0;
      ray.end = min(ray.end, (border - ray.origin[axis]) / ray.along[axis]);
    }
  }
  ray.end = max(ray.end, 0.0);
  // A ray straight at the eye or away from it stays where it is.
  if (max(abs(ray.along.x), abs(ray.along.y)) * ray.end < 1.0) {
    ray.end = 0.0;
  }
  return ray;
}

float least_depth_of(int level, ivec2 cell)
{
  if (level == 0) {
    return texelFetch(depth, cell, 0).x;
  }
  return texelFetch(pyramid, cell + ivec2(mirrors.lefts[(level - 1) / 4][(level - 1) % 4], 0), 0).x;
}

bool screen_meets(ivec2 pixel, ivec2 start, vec3 direction, float surface, float nearest)
{
  ivec2 moved = abs(pixel - start);
  return max(moved.x, moved.y) >= 1 && surface < NOWHERE && nearest <= surface + mirrors.thickness
    && dot(texelFetch(gbuffer_geometry, pixel, 0).xyz, direction) < 0.0;
}

ScreenHit search_blocks(ScreenRay ray, vec3 direction)
{
  ScreenHit hit = ScreenHit(ivec2(-1), 0.0, 0.0);
  ivec2 start = clamp(ivec2(floor(ray.origin)), ivec2(0), frame.size - 1), pixel = start;
  ivec2 ahead = ivec2(greaterThan(ray.along, vec2(0.0)));
  float s = 0.0;
  int level = 0;
  for (int i = 0; i < mirrors.steps && ray.end > 0.0; i++) {
    ivec2 cell = pixel >> level, edge = (cell + ahead) << level;
    vec2 crossing = vec2(1e30);
    for (int k = 0; k < 2; k++) {
      if (ray.along[k] != 0.0) {
        crossing[k] = (float(edge[k]) - ray.origin[k]) / ray.along[k];
      }
    }
    int axis = crossing.x <= crossing.y ? 0 : 1;
    float leave = max(min(crossing[axis], ray.end), s);
    float one = ray_depth(ray, s), other = ray_depth(ray, leave);
    float least = least_depth_of(level, cell);
    bool passes = max(one, other) < least;
    if (!passes && level == 0 && screen_meets(pixel, start, direction, least, min(one, other))) {
      float slope = ray.depths.y - ray.depths.x - least * (ray.inverse_w.y - ray.inverse_w.x);
      float at = (least * ray.inverse_w.x - ray.depths.x) / (abs(slope) > 1e-20 ? slope : 1e-20);
      hit.pixel = pixel;
      hit.s = clamp(at, s, leave);
      hit.behind = max(ray_depth(ray, hit.s) - least, 0.0);
      return hit;
    }
    if (passes || level == 0) {
      ivec2 low = cell << level;
      ivec2 moved = level == 0 ? pixel : clamp(ivec2(floor(ray.origin + ray.along * leave)), low, low + (1 << level) - 1);
      moved[axis] = edge[axis] - 1 + ahead[axis];
      if (leave >= ray.end || any(lessThan(moved, ivec2(0))) || any(greaterThanEqual(moved, frame.size))) {
        return hit;
      }
      pixel = moved;
      s = leave;
    }
    level = passes ? min(level + 1, mirrors.top) : max(level - 1, 0);
  }
  return hit;
}

ivec2 pixel_at(ScreenRay ray, float s)
{
  return clamp(ivec2(floor(ray.origin + ray.along * s)), ivec2(0), frame.size - 1);
}

ScreenHit march_steps(ScreenRay ray, vec3 direction)
{
  ScreenHit hit = ScreenHit(ivec2(-1), 0.0, 0.0);
  ivec2 start = clamp(ivec2(floor(ray.origin)), ivec2(0), frame.size - 1);
  float before = 0.0;
  for (int i = 1; i <= mirrors.steps && ray.end > 0.0; i++) {
    float s = min((float(i) - 1.0 + mirrors.jitter) / float(mirrors.steps), 1.0) * ray.end;
    float surface = least_depth_of(0, pixel_at(ray, s)), one = ray_depth(ray, before), other = ray_depth(ray, s);
    if (max(one, other) >= surface && min(one, other) <= surface + mirrors.thickness && surface < NOWHERE) {
      float low = before, high = s;
      for (int k = 0; k < BISECTIONS; k++) {
        float middle = 0.5 * (low + high);
        if (ray_depth(ray, middle) >= least_depth_of(0, pixel_at(ray, middle))) {
          high = middle;
        } else {
          low = middle;
        }
      }
      ivec2 pixel = pixel_at(ray, high);
      float off = ray_depth(ray, high) - least_depth_of(0, pixel);
      if (off <= mirrors.thickness && screen_meets(pixel, start, direction, least_depth_of(0, pixel), -NOWHERE)) {
        hit.pixel = pixel;
        hit.s = high;
        hit.behind = max(off, 0.0);
        return hit;
      }
    }
    before = s;
  }
  return hit;
}
