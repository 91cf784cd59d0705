// The depth that a fragment shader sets.
uniform vec2 window_depth_terms;  // NDC depth = x + y / z
// The largest float below 1: a surface at the far plane stays in front of the background, which has
// depth 1.
const float kMaxWindowDepth = 0.99999994;

// Returns the window depth of an NDC depth, clamped to 0 .. kMaxWindowDepth.
float window_depth(float ndc_depth) {
  return clamp(0.5 + 0.5 * ndc_depth, 0.0, kMaxWindowDepth);
}
