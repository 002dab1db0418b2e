#version 330 core
// Position only: for the shadow map and for silhouettes. Must compute the position
// exactly as scene.vert does, so that both cover the same samples.
layout(location = 0) in vec3 position;
layout(location = 4) in mat4 instance;
uniform mat4 view_projection;
invariant gl_Position;

void main() {
    mat3 turn = mat3(instance);
    vec3 world = turn * position + instance[3].xyz;
    gl_Position = view_projection * vec4(world, 1.0);
}
