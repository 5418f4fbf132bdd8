/* What all kernels share: names, checks of indices, small vectors.

   Plain C11 with no dependency but the C library's mathematics. Everything is compiled twice on x86-64, for any processor and for
   those with AVX2, under names that end in the variant; the two give the same bits, since contraction is off and no sum is
   reordered by the compiler. Arrays are dense, in C order, float32 and int32 unless said otherwise; Python has checked their sizes.
   Each function is the twin of a numpy one, named beside it. */

#ifndef RTGI_H
#define RTGI_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifndef RTGI_VARIANT
#define RTGI_VARIANT base
#endif
#define RTGI_JOIN2(a, b) a##_##b
#define RTGI_JOIN(a, b) RTGI_JOIN2(a, b)
#define KERNEL(name) RTGI_JOIN(rtgi_##name, RTGI_VARIANT)

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* In debug builds every index that comes out of an array is held to the length of what it points into. */
#ifdef RTGI_CHECKED
#include <stdio.h>
#include <stdlib.h>
static inline void rtgi_outside(const char *file, int line, long long index, long long count)
{
  fprintf(stderr, "%s:%d: index %lld of %lld\n", file, line, index, count);
  abort();
}
#define WITHIN(index, count)                                                                            \
  do {                                                                                                  \
    if ((int64_t)(index) < 0 || (int64_t)(index) >= (int64_t)(count)) {                                 \
      rtgi_outside(__FILE__, __LINE__, (long long)(index), (long long)(count));                         \
    }                                                                                                   \
  } while (0)
#else
#define WITHIN(index, count) ((void)0)
#endif

#define PI_F 3.14159265358979323846f
#define TINY_F 1.17549435e-38f

typedef struct {
  float x, y, z;
} Vec;

static inline Vec load(const float *p, int64_t row)
{
  return (Vec){p[3 * row], p[3 * row + 1], p[3 * row + 2]};
}

static inline void store(float *p, int64_t row, Vec v)
{
  p[3 * row] = v.x;
  p[3 * row + 1] = v.y;
  p[3 * row + 2] = v.z;
}

static inline float dot(Vec a, Vec b)
{
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec add(Vec a, Vec b)
{
  return (Vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vec sub(Vec a, Vec b)
{
  return (Vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vec mul(Vec a, float s)
{
  return (Vec){a.x * s, a.y * s, a.z * s};
}

static inline Vec divided(Vec a, float s)
{
  return (Vec){a.x / s, a.y / s, a.z / s};
}

static inline float largest(float a, float b)
{
  return a > b ? a : b;
}

static inline float smallest(float a, float b)
{
  return a < b ? a : b;
}

static inline float clamped(float x, float low, float high)
{
  return x < low ? low : (x > high ? high : x);
}

static inline Vec normalized(Vec v)
{
  return divided(v, largest(sqrtf(dot(v, v)), TINY_F));
}

static inline float farthest(Vec p)
{
  return largest(largest(fabsf(p.x), fabsf(p.y)), fabsf(p.z));
}

#endif
