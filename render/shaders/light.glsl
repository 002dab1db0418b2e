#if defined(GROUND) || defined(FOLIAGE) || defined(DISTANT)
#define LIT_AT_CORNERS // one normal a triangle, or small triangles
#endif
#if defined(FOLIAGE) || defined(DISTANT)
#define HAZE_AT_CORNERS
#endif
#if defined(DISTANT)
#undef LAMPLIT // beyond the light of lamps
#endif

uniform vec3 eye;
uniform vec3 to_sun;
uniform vec3 sun;
uniform vec3 ambient;
uniform vec3 ground;
uniform vec3 zenith;
uniform vec3 horizon;
uniform vec3 glow;
uniform float haze;
uniform float lamps;

vec3 clear_sky(vec3 direction) {
    float up = max(direction.z, 0.0);
    return mix(zenith, horizon, 1.0 / (1.0 + 4.0 * up * (1.0 + 2.0 * up)));
}

vec3 sky(vec3 direction) {
    float near_sun = max(dot(direction, to_sun), 0.0);
    float wide = near_sun * near_sun * near_sun;
    float tight = wide * wide;
    tight *= tight;
    tight *= tight;
    return clear_sky(direction) + glow * (0.5 * wide * wide + 1.5 * tight);
}

float seen_through(float thick) {
#if defined(THICK_AIR)
    // exp(-t) as 1 / exp(t / 8)^8, error < 0.001: exp takes a quarter of the frame time
    float eighth = min(thick, 80.0) / 8.0;
    float dims = 1.0 + eighth * (1.0 + eighth * (0.5 + eighth / 6.0));
    dims *= dims;
    dims *= dims;
    return 1.0 / (dims * dims);
#else
    return 1.0 / (1.0 + thick * (1.0 + 0.5 * thick)); // approximates exp(-t)
#endif
}

vec3 film(vec3 light) {
    // Narkowicz's fit of the ACES tone curve; a square root approximates the display's
    // gamma of 2.2, which would take half the shader's time.
    vec3 mapped = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14);
    return sqrt(clamp(mapped, 0.0, 1.0));
}
