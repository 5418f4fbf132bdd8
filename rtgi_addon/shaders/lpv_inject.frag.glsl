// One target a colour channel.

void main()
{
  out_red = lobe * light_flux.r;
  out_green = lobe * light_flux.g;
  out_blue = lobe * light_flux.b;
}
