#version 330 core
//include light.glsl

in vec3 direction;
layout(location = 0) out vec4 picture;
layout(location = 1) out uint instance_id;

void main() {
    instance_id = 0u;
    picture = vec4(film(sky(normalize(direction))), 1.0);
}
