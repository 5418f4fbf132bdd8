// The octahedral map of directions (numerics/octahedral.py).

// Square coordinates from -1 to 1 of a direction of any length.
vec2 octahedral_encode(vec3 direction)
{
  vec2 xy = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
  vec2 folded = (1.0 - abs(xy.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(xy, vec2(0.0)));
  return direction.z < 0.0 ? folded : xy;
}
