#version 450 core
// The hull in the light's view.
in vec2 at;
uniform sampler2D depth_m;        // along the light's z; 0: no hull
uniform vec2 window_depth_terms;  // NDC depth = x + y / z
out float inverse_depth;

void main() {
  float z = texture(depth_m, at).r;
  if (z == 0.0) discard;
  inverse_depth = 1.0 / z;
  gl_FragDepth =
      clamp(0.5 + 0.5 * (window_depth_terms.x + window_depth_terms.y * inverse_depth), 0.0, 1.0);
}
