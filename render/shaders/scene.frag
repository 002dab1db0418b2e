#version 330 core
// Compiled three times, for ground, standing things and vehicles (GROUND, STANDING,
// VEHICLES): a software renderer pays for every branch, taken or not.
//include light.glsl

in vec3 world;
#if defined(GROUND)
flat in vec3 facing;
flat in vec3 albedo;
#else
in vec3 facing;
in vec3 albedo;
#endif
in vec3 in_light;
flat in uint identity;
flat in int kind;

uniform sampler2DShadow shadow_map;
uniform sampler2D grain;
uniform int has_shadows;

layout(location = 0) out vec4 picture;
layout(location = 1) out uint instance_id;

const int ASPHALT = 1, GRASS = 2, PAINT = 3, GLASS = 4, LAMP = 5, FOLIAGE = 6;

float lit_share(float slope) {
    vec3 spot = vec3(in_light.xy, in_light.z - 0.0012 - 0.002 * (1.0 - slope));
    float lit = texture(shadow_map, spot);
    vec2 edge = abs(in_light.xy - 0.5) * 2.0;
    float outside = clamp((max(edge.x, edge.y) - 0.85) / 0.13, 0.0, 1.0);
    return max(lit, max(outside, float(1 - has_shadows)));
}

void main() {
    instance_id = identity;
    vec3 to_eye = eye - world;
    float distance_m = length(to_eye);
    to_eye /= distance_m;
    vec3 colour = albedo;

#if defined(GROUND)
    vec3 n = facing;
    float rough = kind == GRASS ? 1.0 : 0.42;
    colour *= 1.0 + rough * (texture(grain, world.xy / 9.0).r - 0.5);
    float slope = max(dot(n, to_sun), 0.0);
#else
    vec3 n = normalize(facing);
    n = kind != FOLIAGE && dot(n, to_eye) < 0.0 ? -n : n;
    float toward = dot(n, to_sun);
    float slope = clamp(kind == FOLIAGE ? 0.25 + 0.75 * toward : toward, 0.0, 1.0);
#endif

    float share = lit_share(slope);
    vec3 around = mix(ground, ambient, 0.5 + 0.5 * n.z);
    vec3 light = colour * (sun * (slope * share * 1.35) + around);

#if defined(VEHICLES)
    float mirrors = kind == PAINT || kind == GLASS ? 1.0 : 0.0;
    float grazing = 1.0 - max(dot(n, to_eye), 0.0);
    grazing *= grazing;
    float strength = 0.05 + 0.55 * grazing * grazing;
    strength = mirrors * (kind == GLASS ? 0.9 * (strength + 0.1) : 0.55 * strength);
    vec3 bounce = reflect(-to_eye, n);
    light = mix(light, bounce.z > 0.0 ? clear_sky(bounce) : ground, strength);
    float shine = max(dot(bounce, to_sun), 0.0);
    shine *= shine;
    shine *= shine;
    shine *= shine;
    shine *= shine;
    light += sun * (mirrors * share * 0.7 * shine * shine);
#endif
#if !defined(GROUND)
    light += kind == LAMP ? colour * (lamps * 1.6) : vec3(0.0);
#endif

    float thick = haze * distance_m; // 1 / (1 + t + t^2 / 2) stands for exp(-t): cheaper
    light = mix(horizon, light, 1.0 / (1.0 + thick * (1.0 + 0.5 * thick)));
    picture = vec4(film(light), 1.0);
}
