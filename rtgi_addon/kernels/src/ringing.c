/* Probes that ring: twin of _lowest_irradiance in techniques/lattice/reconstruction.py, in double precision, for SH of bands up to 2. */

#include "rtgi.h"

enum { MOST_TERMS = 9, MOST_RING = 32 };

static void sh_at(const double *d, int order, double *row)
{
  double x = d[0], y = d[1], z = d[2];
  row[0] = 0.28209479177387814;
  if (order >= 1) {
    row[1] = 0.4886025119029199 * y;
    row[2] = 0.4886025119029199 * z;
    row[3] = 0.4886025119029199 * x;
  }
  if (order >= 2) {
    row[4] = 1.0925484305920792 * x * y;
    row[5] = 1.0925484305920792 * y * z;
    row[6] = 0.9461746957575601 * z * z - 0.31539156525252005;
    row[7] = 1.0925484305920792 * x * z;
    row[8] = 0.5462742152960396 * (x * x - y * y);
  }
}

static double height(const double *row, const double *terms, int64_t count)
{
  double sum = 0.0;
  for (int64_t i = 0; i < count; i++) {
    sum += row[i] * terms[i];
  }
  return sum;
}

/* Walk from the direction centre to a lower one by steps that halve, around in a ring (ring, 2) of cosines and sines. Returns what is
   found there. */
static double descend(double *centre, const double *terms, int order, double step, int64_t refinements, int64_t ring,
                      const double *around)
{
  int64_t count = (order + 1) * (order + 1);
  double row[MOST_TERMS], least = 0.0;
  for (int64_t r = 0; r < refinements; r++) {
    double sign = copysign(1.0, centre[2]), a = -1.0 / (sign + centre[2]), b = centre[0] * centre[1] * a, best[3];
    double tangent[3] = {1.0 + sign * centre[0] * centre[0] * a, sign * b, -sign * centre[0]};
    double bitangent[3] = {b, sign + centre[1] * centre[1] * a, -centre[1]};
    for (int64_t i = -1; i < ring; i++) {
      double at[3], length = 0.0;
      for (int axis = 0; axis < 3; axis++) {
        at[axis] = centre[axis];
        if (i >= 0) {
          at[axis] += step * (around[2 * i] * tangent[axis] + around[2 * i + 1] * bitangent[axis]);
        }
        length += at[axis] * at[axis];
      }
      length = sqrt(length);
      for (int axis = 0; axis < 3; axis++) {
        at[axis] /= length;
      }
      sh_at(at, order, row);
      double found = height(row, terms, count);
      if (i < 0 || found < least) {
        least = found;
        memcpy(best, at, sizeof best);
      }
    }
    memcpy(centre, best, sizeof best);
    step *= 0.5;
  }
  return least;
}

/* Lowest irradiance (p, c) of each channel of probes with convolved coefficients (p, k, c), and the direction (p, c, 3) where it is: the
   best of common directions (d, 3) with their basis (d, k), and from there down by a walk that begins with a step, where what bends
   between samples could lie below 0. */
EXPORT void KERNEL(lowest_irradiance)(int64_t p, int32_t order, int64_t c, const double *convolved, int64_t d,
                                      const double *directions, const double *basis, double step, int64_t refinements, int64_t ring,
                                      const double *around, double *values, double *found)
{
  int64_t k = (order + 1) * (order + 1);
  double terms[MOST_TERMS], bend = 0.5 * (step * order) * (step * order);
  WITHIN(k - 1, MOST_TERMS);
  for (int64_t row = 0; row < p * c; row++) {
    int64_t best = 0;
    double least = INFINITY, most = -INFINITY;
    for (int64_t i = 0; i < k; i++) {
      terms[i] = convolved[(row / c * k + i) * c + row % c];
    }
    for (int64_t i = 0; i < d; i++) {
      double here = height(basis + i * k, terms, k);
      most = here > most ? here : most;
      if (here < least) {
        least = here;
        best = i;
      }
    }
    memcpy(found + 3 * row, directions + 3 * best, 3 * sizeof *found);
    values[row] = least;
    if (least < bend * (most - least)) {
      values[row] = descend(found + 3 * row, terms, order, step, refinements, ring, around);
    }
  }
}
