// Real spherical harmonics up to SH_ORDER (numerics/sh.py), four to a vector in the order 1, y, z, x, xy, yz, 3z^2 - 1, xz,
// x^2 - y^2, ...; what is beyond the last one is zero, or is met by coefficients that are.

#define SH_BLOCKS (((SH_ORDER + 1) * (SH_ORDER + 1) + 3) / 4)

void sh_basis(vec3 n, out vec4 basis[SH_BLOCKS])
{
#if SH_ORDER <= 2
  basis[0] = vec4(0.28209479, 0.48860251 * n.y, 0.48860251 * n.z, 0.48860251 * n.x);
#  if SH_ORDER == 2
  basis[1] = vec4(1.09254843 * n.x * n.y, 1.09254843 * n.y * n.z, 0.94617470 * n.z * n.z - 0.31539157, 1.09254843 * n.x * n.z);
  basis[2] = vec4(0.54627422 * (n.x + n.y) * (n.x - n.y), 0.0, 0.0, 0.0);
#  endif
#else
  for (int block = 0; block < SH_BLOCKS; block++) {
    basis[block] = vec4(0.0);
  }
  // (x + iy)^m times the normalised Legendre function of z over sin^m, upwards in l from the two bands below.
  vec2 power = vec2(1.0, 0.0);
  float diagonal = 0.28209479;
  for (int m = 0; m <= SH_ORDER; m++) {
    if (m > 0) {
      power = vec2(n.x * power.x - n.y * power.y, n.x * power.y + n.y * power.x);
      diagonal *= sqrt((2.0 * float(m) + 1.0) / (2.0 * float(m)));
    }
    float below = 0.0;
    float current = diagonal * (m > 0 ? 1.41421356 : 1.0);
    for (int l = m; l <= SH_ORDER; l++) {
      if (l > m) {
        float ll = float(l * l);
        float mm = float(m * m);
        float before = float((l - 1) * (l - 1));
        float a = sqrt((4.0 * ll - 1.0) / (ll - mm));
        float following = a * (n.z * current - sqrt((before - mm) / (4.0 * before - 1.0)) * below);
        below = current;
        current = following;
      }
      int index = l * l + l + m;
      basis[index / 4][index % 4] = current * power.x;
      if (m > 0) {
        index -= 2 * m;
        basis[index / 4][index % 4] = current * power.y;
      }
    }
  }
#endif
}
