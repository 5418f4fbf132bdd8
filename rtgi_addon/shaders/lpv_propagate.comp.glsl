// One step of light from cell to cell (techniques/lpv/propagation.py). A texel holds a channel's flux P and vector flux as
// (P, Jy, Jz, Jx). Per cell and axis k, from the neighbour that sends in direction s:
//   P' += t + w,  J'k += s t,  J'a += Ta Ja,  J'b += Tb Jb,  t = T0 (P + 2s Jk),  w = Tw (P + 2s c Jk)
// and what the blockers at the cell's own faces send back.
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
        vec4 through = block_texel(faces, axis, end == 0 ? from : texel);
        for (int c = 0; c < 3; c++) {
          vec4 light = sent.channel[c];
          float front = through.x * (light.x + 2.0 * s * light[row]);
          result.channel[c].x += front + through.y * (light.x + 2.0 * s * parameters.side_ahead * light[row]);
          result.channel[c][row] += s * front;
          result.channel[c][row_a] += through.z * light[row_a];
          result.channel[c][row_b] += through.w * light[row_b];
        }
      }
      if (parameters.bounces != 0) {
        // Blocked shares and the blocker's normal along the axis and the next; its albedo and the normal along the last.
        vec4 blocker = block_texel(blockers, 2 * (2 * axis + end), texel);
        vec4 surface = block_texel(blockers, 2 * (2 * axis + end) + 1, texel);
        for (int c = 0; c < 3; c++) {
          vec4 light = own.channel[c];
          float met = blocker.x * (light.x + 2.0 * s * light[row]) +
                      blocker.y * (light.x + 2.0 * s * parameters.side_ahead * light[row]);
          // Light cannot be negative: the back of a lobe is returned whole, whatever the albedo.
          float back = max(met, 0.0) * surface[c] + min(met, 0.0);
          result.channel[c].x += back;
          result.channel[c][row] -= s * back * blocker.z;
          result.channel[c][row_a] -= s * back * blocker.w;
          result.channel[c][row_b] -= s * back * surface.w;
        }
      }
    }
  }
  imageStore(next_red, texel, result.channel[0]);
  imageStore(next_green, texel, result.channel[1]);
  imageStore(next_blue, texel, result.channel[2]);
  // The sum begins with the light itself.
  if (parameters.accumulate != 0) {
    own.channel[0] = imageLoad(total_red, texel);
    own.channel[1] = imageLoad(total_green, texel);
    own.channel[2] = imageLoad(total_blue, texel);
  }
  imageStore(total_red, texel, own.channel[0] + result.channel[0]);
  imageStore(total_green, texel, own.channel[1] + result.channel[1]);
  imageStore(total_blue, texel, own.channel[2] + result.channel[2]);
}
