#version 450 core
//! variant
//! variant -DFLAT
//! variant -DCHECKER -DWARMED
//! variant -DFLAT -DCHECKER -DWARMED
//! variant -DSHADOWED
//! variant -DFLAT -DSHADOWED
//! variant -DTEXTURED
//! variant -DCHECKER -DWARMED -DTEXTURED -DSHADOWED
// Pixels of a virtual object; object.vert explains the defines. Both sides of a surface are lit:
// the normal is turned towards the viewer. The checker is averaged over the footprint of the pixel
// (Quilez, "Filtering the checkerboard pattern").
//! include "light.glsl"
#ifdef SHADOWED
//! include "shadow.glsl"
in vec3 p_light;
#endif
in vec3 to_light;
flat in vec3 surface_albedo;
#ifdef FLAT
flat in vec2 towards_light_and_up;
#else
in vec3 normal_eye;
in float normal_up;
#endif
out vec3 colour;

#ifdef CHECKER
// Odd cells reflect less light than even cells by this fraction.
#define DARKER_ODD_CELLS 0.38
// Smallest footprint [half cells]: a smaller one would divide the rounding errors of fract().
#define MIN_FOOTPRINT 5e-5
in vec2 half_cell;
// Returns the fraction of the pixel's footprint that odd cells cover.
float odd() {
  vec2 footprint = max(fwidth(half_cell), vec2(MIN_FOOTPRINT));
  vec2 i = abs(fract(half_cell - 0.5 * footprint) - 0.5) -
           abs(fract(half_cell + 0.5 * footprint) - 0.5);
  return 0.5 - 0.5 * (i.x * i.y) / (footprint.x * footprint.y);
}
#endif
#ifdef WARMED
in float warmth;
uniform vec3 warm_albedo;  // at warmth 1; the surface also glows in this colour
#endif
#ifdef TEXTURED
flat in vec3 surface_added;
in vec2 texture_uv;
uniform sampler2D base_colour;  // sRGB in memory, linear here
#endif

void main() {
  vec3 surface = surface_albedo;
#ifdef TEXTURED
  surface = surface * texture(base_colour, texture_uv).rgb + surface_added;
#endif
#ifdef CHECKER
  surface *= 1.0 - DARKER_ODD_CELLS * odd();
#endif
#ifdef WARMED
  surface = mix(surface, warm_albedo, warmth);
#endif
#ifdef FLAT
  vec2 towards = towards_light_and_up;
#else
  // Interpolation between smooth corners shortens the normal, so normalise it.
  vec2 towards = (gl_FrontFacing ? 1.0 : -1.0) *
                 inversesqrt(dot(normal_eye, normal_eye)) *
                 vec2(dot(normal_eye, to_light), normal_up);
#endif
#ifdef SHADOWED
  // The normal of the triangle: a smooth normal is not that of the surface in the map.
  vec3 normal_light = cross(dFdx(p_light), dFdy(p_light));
  if (towards.x > 0.0) towards.x *= light_reaching(p_light, normal_light);
#endif
  vec3 light = lit(surface, towards.x, towards.y, dot(to_light, to_light));
#ifdef WARMED
  light += 0.4 * warmth * warm_albedo;
#endif
  colour = srgb(light);
}
