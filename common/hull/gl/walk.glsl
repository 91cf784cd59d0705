// Steps of a ray's image from pixel border to pixel border, in double, as in ray_walk.cpp.
const double kNever = 1e30lf;

// Returns the pixel of the image at depth t, clamped to [low, high].
int pixel(double offset, double slope, double w, double t, int low, int high) {
  double at = (offset + t * slope) / w;
  return !(at > double(low)) ? low : at >= double(high) ? high : int(floor(at));
}

// Returns the depth >= t at which the image crosses `border`, or kNever.
double crossing(double offset, double slope, double w_offset, double w_slope, double border,
                double t) {
  double at = (border * w_offset - offset) / (slope - border * w_slope);
  if (at > t) return at;
  // The image is at the border already because of rounding, or reaches it only behind the camera.
  return w_offset + at * w_slope > 0 ? t : kNever;
}
