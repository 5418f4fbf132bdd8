// The world's light alone, with nothing in its way: order-2 SH of its radiance (numerics/sh.py, irradiance).

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec3 n = normal_world;
  float basis[9] = float[9](0.2820947918, 0.4886025119 * n.y, 0.4886025119 * n.z, 0.4886025119 * n.x, 1.0925484306 * n.x * n.y,
                            1.0925484306 * n.y * n.z, 0.3153915653 * (3.0 * n.z * n.z - 1.0), 1.0925484306 * n.x * n.z,
                            0.5462742153 * (n.x * n.x - n.y * n.y));
  vec3 total = vec3(0.0);
  for (int i = 0; i < 9; i++) {
    total += basis[i] * world_light.cosine_sh[i].rgb;
  }
  return total;
}
