#version 330 core
in vec3 colour;
layout(location = 0) out vec4 picture;
layout(location = 1) out uint instance_id;

void main() {
    instance_id = 0u;
    picture = vec4(colour, 1.0);
}
