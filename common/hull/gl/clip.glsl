// Clips a range of depths to half-spaces.
const double kNearestToCamera_m = 1e-9lf;  // as in map_from_view.h

// Depths that remain: first, last [m].
dvec2 range;
// Keeps the depths t with offset + t * slope >= 0.
void clip(double offset, double slope) {
  bool at_begin = offset + range.x * slope >= 0.0lf, at_end = offset + range.y * slope >= 0.0lf;
  if (at_begin && at_end) return;
  double t = -offset / slope;
  if (at_end)
    range.x = max(range.x, t);
  else if (at_begin)
    range.y = min(range.y, t);
  else
    range.y = range.x;
}

// Keeps the depths at which a ray is in the rule's box. Requires view.glsl.
void clip_to_box(dvec2 ray) {
  dvec3 direction = direction_of(ray), above = eye_m.xyz - box_min_m.xyz,
        below = box_max_m.xyz - eye_m.xyz;
  for (int axis = 0; axis < 3; ++axis) {
    if (range.x < range.y) clip(above[axis], direction[axis]);
    if (range.x < range.y) clip(below[axis], -direction[axis]);
  }
}
