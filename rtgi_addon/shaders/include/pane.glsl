// What a flat convex quadrilateral of radiance 1 gives a plane in closed form: transport/lights/panes.py, which derives it.

float pane_edge(vec3 a, vec3 b, vec3 normal)
{
  vec3 across = cross(b, a);
  float length_of = length(across);
  return length_of > 0.0 ? atan(length_of, dot(a, b)) * dot(across, normal) / length_of : 0.0;
}

// Irradiance over radiance [sr] at `point`, and the share of the pane's area that is above the horizon there.
float pane_factor(vec3 point, vec3 normal, out float above)
{
  float total = 0.0;
  vec3 area = vec3(0.0);
  vec3 leaving = vec3(0.0);
  vec3 coming = vec3(0.0);
  vec3 base = pane.corners[0].xyz - point;
  for (int start = 0; start < 4; start++) {
    vec3 a = pane.corners[start].xyz - point;
    vec3 b = pane.corners[(start + 1) & 3].xyz - point;
    float height_a = dot(a, normal);
    float height_b = dot(b, normal);
    bool below_a = height_a < 0.0;
    bool below_b = height_b < 0.0;
    if (below_a && below_b) {
      continue;
    }
    if (below_a != below_b) {
      vec3 crossing = mix(a, b, clamp(height_a / (height_a - height_b), 0.0, 1.0));
      if (below_b) {
        leaving = crossing;
        b = crossing;
      }
      else {
        coming = crossing;
        a = crossing;
      }
    }
    total += pane_edge(a, b, normal);
    area += cross(a - base, b - base);
  }
  // The horizon closes what it cut.
  if (leaving != coming) {
    total += pane_edge(leaving, coming, normal);
    area += cross(leaving - base, coming - base);
  }
  above = clamp(0.5 * length(area) / pane.area, 0.0, 1.0);
  return max(0.5 * total, 0.0);
}
