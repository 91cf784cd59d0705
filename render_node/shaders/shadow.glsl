// Shadows of the scene's light: percentage-closer filtering of a map of inverse depths (Reeves,
// Salesin and Cook, "Rendering Antialiased Shadows with Depth Maps", 1987). Each of the four texels
// around a point is compared with the depth that the point's surface has there, so that a surface
// does not shadow itself: for a plane n . p = d, 1 / depth = n . ray / d.
uniform sampler2D shadow_map;    // 1 / depth from the light [1/m]; 0: nothing there
uniform float light_focal;       // focal length, in widths of the map
uniform float shadow_tolerance;  // of a depth, relative: ShadowMap

// Returns the fraction of the light that reaches a point of a surface: the point and the surface's
// normal in the light's frame (x right, y down, z forward). Points outside the light's view are
// lit.
float light_reaching(vec3 p, vec3 normal) {
  float d = dot(normal, p);
  if (p.z <= 0.0 || d == 0.0) return 1.0;
  vec2 size = vec2(textureSize(shadow_map, 0));
  vec2 to_texel = (0.5 + light_focal * vec2(p.x, -p.y) / p.z) * size - 0.5, f = fract(to_texel);
  // textureGather returns the texels at (0, 1), (1, 1), (1, 0) and (0, 0). The point between them
  // selects them: a GPU locates points in fixed point, and near a texel's centre it may choose the
  // four beside.
  vec2 first = (to_texel - f + 0.5) / size - 0.5, step = 1.0 / size;  // the centre of texel (0, 0)
  float at_first = dot(normal, vec3(first.x, -first.y, light_focal));
  float across = normal.x * step.x, up = -normal.y * step.y;
  vec4 surface = (at_first + vec4(up, across + up, across, 0.0)) / (light_focal * d);
  vec4 lit = vec4(greaterThanEqual(surface * (1.0 + shadow_tolerance),
                                   textureGather(shadow_map, (to_texel - f + 1.0) / size)));
  return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}
