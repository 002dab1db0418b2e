#version 330 core
//include light.glsl
// For static and moving objects. The last row of an instance's matrix, constant in an
// affine map, carries its paint and id.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 surface;
layout(location = 3) in vec4 colour;
layout(location = 4) in mat4 instance;

uniform mat4 view_projection;

#if defined(GROUND) // one normal and colour for each triangle
#define EVEN flat
#else
#define EVEN
#endif
out vec3 world;
EVEN out vec3 facing;
EVEN out vec3 albedo;
#if defined(LIT_AT_CORNERS)
EVEN out vec3 direct;
EVEN out vec3 indirect;
out float slope;
#if defined(HAZE_AT_CORNERS)
out float distance_m;
#endif
#endif
flat out uint identity;
flat out int kind;
#if defined(SHADOWS)
uniform mat4 to_light;
out vec3 in_light;
#endif
#if defined(LAMPLIT)
uniform mat4 to_lamp_map;
out vec2 in_lamp_map;
out float above_wheels;
#endif
#if defined(TUNNEL)
uniform mat4 to_cover;
out vec2 in_cover;
#endif

invariant gl_Position;

const int ASPHALT = 1;

#if defined(LIT_AT_CORNERS)
void light_corner() {
    float toward = dot(facing, to_sun);
#if defined(GROUND)
    slope = max(toward, 0.0);
#if defined(WET)
    albedo *= kind == ASPHALT ? 0.5 : 0.75;
#endif
#elif defined(FOLIAGE)
    slope = clamp(0.25 + 0.75 * toward, 0.0, 1.0);
#else
    slope = max(toward, 0.0);
#endif
    direct = albedo * sun * (slope * 1.35);
    indirect = albedo * mix(ground, ambient, 0.5 + 0.5 * facing.z);
#if defined(HAZE_AT_CORNERS)
    distance_m = distance(eye, world);
#endif
#if defined(HAZE_AT_CORNERS) && !defined(TUNNEL) // leaves are small, hills all far
    float dims = seen_through(haze * distance_m);
    albedo *= dims;
    direct *= dims;
    indirect = mix(horizon, indirect, dims);
#endif
}
#endif

void main() {
    mat3 turn = mat3(instance);
    world = turn * position + instance[3].xyz;
    facing = turn * normal;
    vec3 paint = vec3(instance[0].w, instance[1].w, instance[2].w);
    vec3 tint = mix(colour.rgb, paint, colour.a);
    albedo = tint * tint;
    kind = int(surface.y + 0.5);
#if defined(LIT_AT_CORNERS)
    light_corner();
#endif
    identity = uint(surface.x + instance[3].w + 0.5);
#if defined(SHADOWS)
    in_light = (to_light * vec4(world, 1.0)).xyz;
#endif
#if defined(LAMPLIT)
    in_lamp_map = (to_lamp_map * vec4(world, 1.0)).xy;
    above_wheels = world.z - instance[3].z;
#endif
#if defined(TUNNEL)
    in_cover = (to_cover * vec4(world, 1.0)).xy;
#endif
    gl_Position = view_projection * vec4(world, 1.0);
}
