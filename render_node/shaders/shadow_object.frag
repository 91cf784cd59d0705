#version 450 core
in float depth_m;
out float inverse_depth;

void main() { inverse_depth = 1.0 / depth_m; }
