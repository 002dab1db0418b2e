#version 330 core
layout(location = 1) out uint instance_id;

void main() {
    instance_id = 1u;
}
