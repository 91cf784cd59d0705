#version 450 core
in float height;
uniform vec3 bottom;
uniform vec3 top;
out vec3 colour;

void main() { colour = mix(bottom, top, height); }
