// A volume's light, scaled, plus another's, into a place of a larger texture.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, parameters.size))) {
    return;
  }
  ivec2 place = texel + parameters.first_texel;
  imageStore(stored_red, place, parameters.scale * texelFetch(light_red, texel, 0) + texelFetch(added_red, texel, 0));
  imageStore(stored_green, place, parameters.scale * texelFetch(light_green, texel, 0) + texelFetch(added_green, texel, 0));
  imageStore(stored_blue, place, parameters.scale * texelFetch(light_blue, texel, 0) + texelFetch(added_blue, texel, 0));
}
