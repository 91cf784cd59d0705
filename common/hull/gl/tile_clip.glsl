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
