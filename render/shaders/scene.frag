#version 330 core
// Compiled for ground, foliage, other static objects, hills and vehicles (GROUND,
// FOLIAGE, STATIC, DISTANT, VEHICLES), for what is beyond shadows and grain (FAR), and
// for the features of the scene: illumination by lamps (LAMPLIT), a wet road (WET), a
// tunnel (TUNNEL), fog or rain (THICK_AIR). A software renderer executes both sides of a
// branch, so features are selected at compile time.
//include light.glsl

#if defined(GROUND)
#define EVEN flat
#else
#define EVEN
#endif
in vec3 world;
EVEN in vec3 facing;
EVEN in vec3 albedo;
#if defined(LIT_AT_CORNERS)
EVEN in vec3 direct; // light of the sun without shadows, and of all around
EVEN in vec3 indirect;
in float slope;
#if defined(HAZE_AT_CORNERS)
in float distance_m;
#endif
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

const int ASPHALT = 1, GRASS = 2, PAINT = 3, GLASS = 4, LAMP = 5;

float lit_share(float slope, float distance_m) {
#if defined(SHADOWS) && !defined(FAR)
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
#if !defined(HAZE_AT_CORNERS)
    vec3 to_eye = eye - world;
    float distance_m = length(to_eye);
    to_eye /= distance_m;
#endif
#if defined(LIT_AT_CORNERS)
    vec3 n = facing;
#else
    vec3 n = normalize(facing);
    n = dot(n, to_eye) < 0.0 ? -n : n;
    float slope = max(dot(n, to_sun), 0.0);
    vec3 direct = albedo * sun * (slope * 1.35);
    vec3 indirect = albedo * mix(ground, ambient, 0.5 + 0.5 * n.z);
#endif

    float share = lit_share(slope, distance_m);
    vec3 added = vec3(0.0); // by lamps
#if defined(TUNNEL)
    vec4 cover = texture(cover_map, in_cover);
    float below = world.z < cover.y + under ? 1.0 : 0.0;
    float daylight = mix(1.0, cover.z, below);
    vec3 inner_light = TUNNEL_LIGHT * (tunnel_lamps * cover.w * below);
    share *= clamp((daylight - 0.6) / 0.4, 0.0, 1.0);
    added += inner_light * (0.75 + 0.25 * n.z);
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
    added += thrown * lit_by;
#endif
#if defined(TUNNEL)
    vec3 light = direct * share + indirect * daylight + albedo * added;
#elif defined(LAMPLIT)
    vec3 light = direct * share + indirect + albedo * added;
#else
    vec3 light = direct * share + indirect;
#endif
#if defined(GROUND) && !defined(FAR)
    float rough = kind == GRASS ? 1.0 : 0.42;
    light *= 1.0 + rough * (texture(grain, world.xy / 9.0).r - 0.5);
#endif
#if defined(GROUND) && defined(WET)
    float is_road = kind == ASPHALT ? 1.0 : 0.0;
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
#if !defined(LIT_AT_CORNERS)
#if defined(TUNNEL)
    float glowing = mix(tunnel_lamps, lamps, daylight);
    light += kind == LAMP ? albedo * (glowing * 1.6) : vec3(0.0);
#else
    light += kind == LAMP ? albedo * (lamps * 1.6) : vec3(0.0);
#endif
#endif

#if defined(TUNNEL) // no haze on the part of the ray inside the tunnel
    float way_in = min(max(tunnel.z, cover.x), tunnel.y);
    way_in = clamp(way_in - max(min(tunnel.z, cover.x), tunnel.x), 0.0, distance_m);
    light = mix(horizon, light, seen_through(haze * (distance_m - way_in)));
#elif !defined(HAZE_AT_CORNERS)
    light = mix(horizon, light, seen_through(haze * distance_m));
#endif
    picture = vec4(film(light), 1.0);
}
