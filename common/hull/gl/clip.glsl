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
