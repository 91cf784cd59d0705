// One point light, dimmer with distance, and light from the sky that is stronger from above. All
// light is linear and in the eye frame (x right, y down, z forward, metres). The shaders convert to
// sRGB themselves, because an sRGB framebuffer of 640x480 pixels takes llvmpipe 6 ms longer.

// Returns the sRGB value of linear light >= 0 to within 0.41 of 255 levels: the minimax quotient of
// these degrees, found by linear programming. It grows beyond 1 with the light.
vec3 srgb(vec3 c) {
  return c * (15.17117 + c * (186.35132 + c * 62.08699)) /
         (1.0 + c * (69.73164 + c * 193.09235));
}

// Lower bound of the squared distance to the light, against a division by zero: a thousandth of the
// distance at which the light has its nominal strength, squared.
const float kMinSquare = 1e-6;

// Returns the light that a surface reflects. towards_light is normal . to_light for a unit normal,
// up is normal . up, square is to_light . to_light. Lengths are in units of the distance at which
// the light has its nominal strength.
vec3 lit(vec3 albedo, float towards_light, float up, float square) {
  square = max(square, kMinSquare);
  float diffuse = 1.6 * max(towards_light, 0.0) / (sqrt(square) * (1.0 + square));
  return albedo * (vec3(0.135, 0.1425, 0.155) + up * vec3(0.065, 0.0775, 0.095) +
                   diffuse * vec3(1.0, 0.97, 0.92));
}
