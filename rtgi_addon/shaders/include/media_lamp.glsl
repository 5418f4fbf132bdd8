// A lamp's light where media scatter it; needs include/lamp.glsl, include/shadow.glsl, include/media.glsl and the struct camera.

// What arrives at a point and is scattered there, dimmed by `media` media and as far as this shadow map sees the point; false where
// nothing does.
bool media_arriving(int media, vec3 point, out LampLight light, out vec3 arriving)
{
  arriving = vec3(0.0);
  float depth = dot(point - camera.position_world, camera.forward_world);
  if (depth < shadow.camera_near || depth >= shadow.camera_far) {
    return false;
  }
  light = lamp_light(point);
  if (light.irradiance == vec3(0.0)) {
    return false;
  }
  arriving = light.irradiance * lamp.scattered;
  if (shadow.casts_shadow != 0) {
    float visible = shadow_visibility(point, light.direction);
    if (visible <= 0.0) {
      return false;
    }
    float distance = lamp.kind == LAMP_SUN ? 2.0 * MEDIA_FAR : light.distance;
    arriving *= visible * media_transmittance(media, point, light.direction, distance);
  }
  return true;
}
