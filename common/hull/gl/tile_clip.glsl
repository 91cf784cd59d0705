// Clips the rays of a tile to where a map can see its object. Requires view.glsl and clip.glsl.
// Relative slack of a tile's range, so that rounding does not cut the range of a single ray.
const double kSlack = 1e-9lf;
const double kSpan = 7.0lf;  // from a tile's first ray to its last

// Clips to the union of the ranges of a tile's rays: the ray with the largest slope has the longest
// range.
void clip_tile(double at_eye, double column, double row, double constant, double extra) {
  clip(at_eye + extra, constant + max(kSpan * column, 0.0lf) + max(kSpan * row, 0.0lf));
}

void clip_to_map(int c, dvec2 corner) {
  dvec3 eye = maps[c].eye.xyz, column = maps[c].column.xyz, row = maps[c].row.xyz,
        first = slope_of(c, corner);
  dvec4 bounds = dvec4(maps[c].bounds);
  clip_tile(eye.z, column.z, row.z, first.z, -kNearestToCamera_m);
  clip_tile(eye.x - bounds.x * eye.z, column.x - bounds.x * column.z, row.x - bounds.x * row.z,
            first.x - bounds.x * first.z, 0.0lf);
  clip_tile(bounds.z * eye.z - eye.x, bounds.z * column.z - column.x, bounds.z * row.z - row.x,
            bounds.z * first.z - first.x, 0.0lf);
  clip_tile(eye.y - bounds.y * eye.z, column.y - bounds.y * column.z, row.y - bounds.y * row.z,
            first.y - bounds.y * first.z, 0.0lf);
  clip_tile(bounds.w * eye.z - eye.y, bounds.w * column.z - column.y, bounds.w * row.z - row.y,
            bounds.w * first.z - first.y, 0.0lf);
}

// Clips to where a ray of the tile may be in the rule's box. Returns whether a ray of the tile may
// be outside it in the remaining range.
uint clip_to_box_of_tile(dvec2 corner) {
  dvec3 column = column_of_view.xyz, row = row_of_view.xyz, first = direction_of(corner);
  dvec3 above = eye_m.xyz - box_min_m.xyz, below = box_max_m.xyz - eye_m.xyz;
  for (int axis = 0; axis < 3; ++axis) {
    if (range.x < range.y) clip_tile(above[axis], column[axis], row[axis], first[axis], 0.0lf);
    if (range.x < range.y) clip_tile(below[axis], -column[axis], -row[axis], -first[axis], 0.0lf);
  }
  dvec3 low = first + min(kSpan * column, dvec3(0.0lf)) + min(kSpan * row, dvec3(0.0lf)),
        high = first + max(kSpan * column, dvec3(0.0lf)) + max(kSpan * row, dvec3(0.0lf));
  bool inside = true;
  for (int end = 0; end < 2; ++end) {
    double t = end == 0 ? range.x * (1.0lf - kSlack) : range.y * (1.0lf + kSlack);
    inside = inside && all(greaterThanEqual(above + t * low, dvec3(0.0lf))) &&
             all(greaterThanEqual(below - t * high, dvec3(0.0lf)));
  }
  return inside ? 0u : 1u;
}
