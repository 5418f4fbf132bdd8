/* What the library says of itself. */

#include "rtgi.h"

/* Goes up whenever a function's arguments or a structure change: Python refuses any other. */
#define VERSION 4

EXPORT int32_t rtgi_version(void)
{
  return VERSION;
}

/* Debug builds have one variant. */
#if defined(__x86_64__) && !defined(RTGI_CHECKED)
#define HAS_VARIANTS
#include <cpuid.h>

/* AVX and its registers saved by the system, FMA, then AVX2, BMI1 and BMI2: what x86-64-v3 takes. Asked of the processor itself, for
   a compiler's own test of it does not link into shared libraries everywhere. */
static int32_t has_avx2(void)
{
  uint32_t a, b, c, d, low, high;
  const uint32_t wanted = (1u << 27) | (1u << 28) | (1u << 12) | (1u << 22) | (1u << 29);
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & wanted) != wanted) {
    return 0;
  }
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  if ((low & 6u) != 6u || !__get_cpuid_count(7, 0, &a, &b, &c, &d)) {
    return 0;
  }
  const uint32_t more = (1u << 3) | (1u << 5) | (1u << 8);
  return (b & more) == more;
}
#endif

/* Whether the processor has what the variant for AVX2 takes. */
EXPORT int32_t rtgi_has_avx2(void)
{
#ifdef HAS_VARIANTS
  return has_avx2();
#else
  return 0;
#endif
}

/* Whether indices are checked: a debug build. */
EXPORT int32_t rtgi_is_checked(void)
{
#ifdef RTGI_CHECKED
  return 1;
#else
  return 0;
#endif
}
