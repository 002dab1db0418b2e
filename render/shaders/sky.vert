#version 330 core
// A grid over the whole image, at the far plane, each row a strip of triangles: the sky
// changes so slowly that its corners show it all.
//include light.glsl

uniform mat4 to_world;
uniform int first_row;
out vec3 colour;
const float COLUMNS = 16.0, ROWS = 30.0; // as drawn by sky.py

void main() {
    int column = gl_VertexID / 2, row = first_row + gl_InstanceID + gl_VertexID % 2;
    vec2 corner = 2.0 * vec2(column, row) / vec2(COLUMNS, ROWS) - 1.0;
    vec4 direction = to_world * vec4(corner, 1.0, 1.0);
    colour = film(sky(normalize(direction.xyz)));
    gl_Position = vec4(corner, 1.0, 1.0);
}
