#version 450 core
// Writes the plane's depth.
layout(location = 0) uniform float plane_depth_m;
out float depth_m;
void main() { depth_m = plane_depth_m; }
