/* One variant of every kernel. */

#include "connect.c"
#include "directions.c"
#include "gather.c"
#include "lamps.c"
#include "layers.c"
#include "pixels.c"
#include "rays.c"
#include "ringing.c"
#include "sampling.c"
#include "surfaces.c"
#include "shading.c"
#include "texels.c"
