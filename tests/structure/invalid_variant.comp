#version 450 core
//! variant -DSIZE=1
//! variant -DSIZE=undeclared
layout(local_size_x = SIZE) in;
void main() {}
