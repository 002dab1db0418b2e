#version 330 core
// Compiled three times, for ground, static objects and vehicles (GROUND, STATIC,
// VEHICLES), and for the features of the scene: illumination by lamps (LAMPLIT), a wet
// road (WET), a tunnel (TUNNEL), fog or rain (THICK_AIR). A software renderer executes
// both sides of a branch, so features are selected at compile time.
//include light.glsl

in vec3 world;
#if defined(GROUND)
flat in vec3 facing;
flat in vec3 albedo;
#else
in vec3 facing;
in vec3 albedo;
#endif
flat in uint identity;
flat in int kind;

uniform sampler2D grain;

#if defined(SHADOWS)
in vec3 in_light;
uniform sampler2DShadow shadow_map; // two maps side by side, for near and for far
uniform mat4 shadow_squares;        // a column for each, see ShadowFit
uniform float shadow_near;
uniform float per_metre; // depth in the maps
#endif

#if defined(LAMPLIT)
in vec2 in_lamp_map;
in float above_wheels;
uniform sampler2D lamp_map; // street, head and tail lamps; head lamps along the axis
uniform vec3 lamp_axis;
uniform float beams;
const vec3 STREET = vec3(0.3, 0.21, 0.115), HEAD = vec3(1.0, 0.96, 0.86);
const vec3 TAIL = vec3(0.16, 0.008, 0.006);
#endif
#if defined(TUNNEL)
in vec2 in_cover;
uniform sampler2D cover_map; // arc length, height of the road, daylight, tunnel lamps
uniform vec3 tunnel;         // arc lengths of both portals and of the eye
uniform float under;         // height from which a point is above the tunnel
uniform float tunnel_lamps;
const vec3 TUNNEL_LIGHT = vec3(0.06, 0.052, 0.039);
#endif

layout(location = 0) out vec4 picture;
layout(location = 1) out uint instance_id;

const int ASPHALT = 1, GRASS = 2, PAINT = 3, GLASS = 4, LAMP = 5, FOLIAGE = 6;

float lit_share(float slope, float distance_m) {
#if defined(SHADOWS)
    bool is_near = distance_m < shadow_near;
    vec4 square = is_near ? shadow_squares[0] : shadow_squares[1];
    vec2 spot = in_light.xy * square.x + square.yz;
    spot.x = clamp(spot.x, 0.00025, 0.49975) + (is_near ? 0.0 : 0.5);
#if defined(GROUND)
    float bias = 0.01; // the ground casts no shadow on itself
#else
    float bias = 0.02 + square.w * (3.0 - 2.0 * slope);
#endif
    return texture(shadow_map, vec3(spot, in_light.z - bias * per_metre));
#else
    return 1.0;
#endif
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

    float share = lit_share(slope, distance_m);
    vec3 around = mix(ground, ambient, 0.5 + 0.5 * n.z);
#if defined(TUNNEL)
    vec4 cover = texture(cover_map, in_cover);
    float below = world.z < cover.y + under ? 1.0 : 0.0;
    float daylight = mix(1.0, cover.z, below);
    vec3 inner_light = TUNNEL_LIGHT * (tunnel_lamps * cover.w * below);
    share *= clamp((daylight - 0.6) / 0.4, 0.0, 1.0);
    around = around * daylight + inner_light * (0.75 + 0.25 * n.z);
#endif
#if defined(LAMPLIT)
    vec4 pool = texture(lamp_map, in_lamp_map);
    float lit_by = beams;
#if defined(TUNNEL)
    lit_by = mix(tunnel_lamps, beams, daylight);
    pool.r *= daylight;
#endif
#if defined(GROUND)
    vec3 thrown = STREET * (pool.r * (0.45 + 0.55 * share)) + HEAD * pool.g;
    thrown += TAIL * pool.b;
#else
    float facing_beam = max(-pool.a * dot(n, lamp_axis), 0.0);
#if defined(VEHICLES)
    float low = above_wheels * above_wheels / 1.4; // low beam: little above the bonnet
    facing_beam *= 1.0 / (1.0 + low * low);
    vec3 thrown = STREET * (pool.r * (0.3 + 0.7 * max(n.z, 0.0)));
#else
    facing_beam *= 0.5;
    vec3 thrown = STREET * (pool.r * 0.4);
#endif
    thrown += HEAD * (2.2 * facing_beam) + TAIL * (0.5 * pool.b);
#endif
    around += thrown * lit_by;
#endif
#if defined(GROUND) && defined(WET)
    float is_road = kind == ASPHALT ? 1.0 : 0.0;
    colour *= mix(0.75, 0.5, is_road);
#endif
    vec3 light = colour * (sun * (slope * share * 1.35) + around);
#if defined(GROUND) && defined(WET)
    // Water reflects the sky by Schlick's approximation, more in ruts and puddles, less
    // than a mirror because of the rough surface below.
    float away = 1.0 - max(dot(n, to_eye), 0.0);
    float away2 = away * away;
    float film_of_water = textureLod(grain, world.xy / vec2(110.0, 40.0), 4.0).r;
    float water = is_road * (0.4 + 0.6 * smoothstep(0.42, 0.62, film_of_water));
    vec3 mirrored = clear_sky(reflect(-to_eye, n));
#if defined(TUNNEL)
    mirrored = mirrored * daylight + inner_light;
#endif
    light += mirrored * (water * 0.75 * (0.02 + 0.98 * away2 * away2 * away));
#endif

#if defined(VEHICLES)
    float mirrors = kind == PAINT || kind == GLASS ? 1.0 : 0.0;
    float grazing = 1.0 - max(dot(n, to_eye), 0.0);
    grazing *= grazing;
    float strength = 0.05 + 0.55 * grazing * grazing;
    strength = mirrors * (kind == GLASS ? 0.9 * (strength + 0.1) : 0.55 * strength);
    vec3 bounce = reflect(-to_eye, n);
#if defined(TUNNEL)
    vec3 seen = bounce.z > 0.0 ? clear_sky(bounce) : ground;
    light = mix(light, seen * daylight + inner_light, strength);
#else
    light = mix(light, bounce.z > 0.0 ? clear_sky(bounce) : ground, strength);
#endif
    float shine = max(dot(bounce, to_sun), 0.0);
    shine *= shine;
    shine *= shine;
    shine *= shine;
    shine *= shine;
    light += sun * (mirrors * share * 0.7 * shine * shine);
#endif
#if !defined(GROUND)
#if defined(TUNNEL)
    float glowing = mix(tunnel_lamps, lamps, daylight);
    light += kind == LAMP ? colour * (glowing * 1.6) : vec3(0.0);
#else
    light += kind == LAMP ? colour * (lamps * 1.6) : vec3(0.0);
#endif
#endif

#if defined(TUNNEL) // no haze on the part of the ray inside the tunnel
    float way_in = min(max(tunnel.z, cover.x), tunnel.y);
    way_in = clamp(way_in - max(min(tunnel.z, cover.x), tunnel.x), 0.0, distance_m);
    float thick = haze * (distance_m - way_in);
#else
    float thick = haze * distance_m; // 1 / (1 + t + t^2 / 2) approximates exp(-t)
#endif
#if defined(THICK_AIR)
    // exp(-t) as 1 / exp(t / 8)^8, error < 0.001: exp takes a quarter of the frame time
    float eighth = min(thick, 80.0) / 8.0;
    float dims = 1.0 + eighth * (1.0 + eighth * (0.5 + eighth / 6.0));
    dims *= dims;
    dims *= dims;
    light = mix(horizon, light, 1.0 / (dims * dims));
#else
    light = mix(horizon, light, 1.0 / (1.0 + thick * (1.0 + 0.5 * thick)));
#endif
    picture = vec4(film(light), 1.0);
}
