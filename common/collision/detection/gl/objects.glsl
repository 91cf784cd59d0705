// The objects, their cameras and their BVHs, and the state of the descent.
struct Object { uint first_box_word[8]; uint first_leaf_word, triangles, first_camera, unused; };
layout(std430, binding = 1) readonly buffer Cameras { Camera object_cameras[]; };
layout(std430, binding = 2) readonly buffer Objects { Object objects[]; };
layout(std430, binding = 3) readonly buffer Trees { float trees[]; };
layout(std430, binding = 4) buffer Descent { Dispatch nodes[9]; Dispatch leaves; };
