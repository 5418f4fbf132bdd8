// One step of light from cell to cell (techniques/lpv/propagation.py). A texel holds a channel's flux P and vector flux F as
// (P, Fy, Fz, Fx). Per cell and axis k, from the neighbour that sends in direction s through a face that lets T through:
//   P' += T (P/6 + s F_k/3),  F'_k += T k (s P/9 + 2 F_k/9),  F'_a += T k 5 F_a/36
// (k: what light keeps of its direction) and what the surfaces at the cell's own faces send back of P/6 + s F_k/3; of all of it, what media leave in the cell.
#include "include/volume.glsl"

// Where a vector's x, y and z stand in a texel.
const int LINEAR[3] = int[3](3, 1, 2);

struct Rgb {
  vec4 channel[3];
};

Rgb light_of(ivec2 texel)
{
  Rgb light;
  light.channel[0] = texelFetch(light_red, texel, 0);
  light.channel[1] = texelFetch(light_green, texel, 0);
  light.channel[2] = texelFetch(light_blue, texel, 0);
  return light;
}

// Blocks of a texture stand side by side, each as large as the atlas.
vec4 block_texel(sampler2D blocks, int block, ivec2 texel)
{
  return texelFetch(blocks, texel + ivec2(block % 4, block / 4) * parameters.size, 0);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  ivec3 resolution = parameters.resolution;
  ivec3 cell = atlas_cell(texel, resolution, parameters.columns);
  if (any(greaterThanEqual(texel, parameters.size)) || !is_inside(cell, resolution)) {
    return;
  }
  Rgb own = light_of(texel);
  vec4 open_above = texelFetch(faces, texel, 0);
  Rgb result;
  result.channel[0] = vec4(0.0);
  result.channel[1] = vec4(0.0);
  result.channel[2] = vec4(0.0);
  for (int axis = 0; axis < 3; axis++) {
    int row = LINEAR[axis];
    int row_a = LINEAR[(axis + 1) % 3];
    int row_b = LINEAR[(axis + 2) % 3];
    for (int end = 0; end < 2; end++) {
      float s = end == 0 ? 1.0 : -1.0;
      ivec3 neighbour = cell;
      neighbour[axis] -= end == 0 ? 1 : -1;
      if (is_inside(neighbour, resolution)) {
        ivec2 from = atlas_texel(neighbour, resolution, parameters.columns);
        Rgb sent = light_of(from);
        // A face belongs to the cell below it.
        float through = end == 0 ? texelFetch(faces, from, 0)[axis] : open_above[axis];
        for (int c = 0; c < 3; c++) {
          vec4 light = through * sent.channel[c];
          result.channel[c].x += parameters.flux_out * light.x + s * parameters.vector_out * light[row];
          result.channel[c][row] += s * parameters.vector_of_flux * light.x + parameters.vector_ahead * light[row];
          result.channel[c][row_a] += parameters.vector_across * light[row_a];
          result.channel[c][row_b] += parameters.vector_across * light[row_b];
        }
      }
      if (parameters.bounces != 0) {
        // The closed share, that of the flux which meets the surface and not its stairs, the surface's normal along the axis and the
        // next; its albedo and the normal along the last.
        vec4 blocker = block_texel(blockers, 2 * (2 * axis + end), texel);
        vec4 surface = block_texel(blockers, 2 * (2 * axis + end) + 1, texel);
        for (int c = 0; c < 3; c++) {
          vec4 light = own.channel[c];
          float met = parameters.flux_out * light.x * blocker.y + s * parameters.vector_out * light[row];
          float spare = parameters.flux_out * light.x * (1.0 - blocker.y);
          float back = blocker.x * met * surface[c];
          result.channel[c].x += back + blocker.x * spare;
          back *= parameters.lobe_vector;
          result.channel[c][row] -= s * back * blocker.z;
          result.channel[c][row_a] -= s * back * blocker.w;
          result.channel[c][row_b] -= s * back * surface.w;
        }
      }
    }
  }
  if (parameters.media != 0) {
    vec3 flux = block_texel(kept, 0, texel).rgb;
    vec3 direction = block_texel(kept, 1, texel).rgb;
    for (int c = 0; c < 3; c++) {
      result.channel[c] *= vec4(flux[c], vec3(direction[c]));
    }
  }
  imageStore(next_red, texel, result.channel[0]);
  imageStore(next_green, texel, result.channel[1]);
  imageStore(next_blue, texel, result.channel[2]);
  // The sum begins with the light itself; a wall's stairs may be larger or smaller than it is.
  float area = open_above.w;
  for (int c = 0; c < 3; c++) {
    own.channel[c] *= area;
  }
  if (parameters.accumulate != 0) {
    own.channel[0] = imageLoad(total_red, texel);
    own.channel[1] = imageLoad(total_green, texel);
    own.channel[2] = imageLoad(total_blue, texel);
  }
  imageStore(total_red, texel, own.channel[0] + area * result.channel[0]);
  imageStore(total_green, texel, own.channel[1] + area * result.channel[1]);
  imageStore(total_blue, texel, own.channel[2] + area * result.channel[2]);
}
