// The picture stretched over the region; bilinear by hand, whatever the texture's own filter is.

vec4 texel(ivec2 at) {
  return texelFetch(picture, clamp(at, ivec2(0), textureSize(picture, 0) - 1), 0);
}

void main() {
  int column = int(gl_FragCoord.x);
  if (column < region.span.x || column >= region.span.y) {
    discard;
  }
  if (region.span.x > 0 && column < region.span.x + 2) {
    color = vec4(1.0);
    return;
  }
  vec2 position = gl_FragCoord.xy / vec2(region.size) * vec2(textureSize(picture, 0)) - 0.5;
  ivec2 low = ivec2(floor(position));
  vec2 share = position - vec2(low);
  vec4 below = mix(texel(low), texel(low + ivec2(1, 0)), share.x);
  vec4 above = mix(texel(low + ivec2(0, 1)), texel(low + ivec2(1, 1)), share.x);
  color = mix(below, above, share.y);
}
