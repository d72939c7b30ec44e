// Tints by height and the relief shading of tools/pyramid/tint.cpp, with the sun for its main light; then haze. kWithHaze
// is set when the program is built.
layout(location = kTintColoursUniform) uniform vec3 tints[kTintColours];

in vec3 relative_m;
in float haze_density;
in float height_share;
in vec3 normal;

out vec4 fragment_colour;

vec3 tint_of(float share) {
    float place = clamp(share, 0.0, 1.0) * float(kTintColours - 1);
    int low = min(int(place), kTintColours - 2);
    return mix(tints[low], tints[low + 1], place - float(low));
}

// 1 on flat ground.
float relief_light(vec3 up) {
    float sun = max(dot(up, sun_direction), 0.0) / max(sun_direction.z, 0.2);
    // West, north-west, north, south-west.
    const float kDiagonal = 0.70710678;
    vec4 towards = vec4(-up.x, kDiagonal * (up.y - up.x), up.y, -kDiagonal * (up.x + up.y));
    float steep = max(dot(up.xy, up.xy), 1e-12);
    float four = 0.5 * dot(1.0 - towards * towards / steep, max(1.7320508 * towards + up.z, 0.0));
    return 0.5 * (sun + four);
}

void main() {
    float off = relief_light(normalize(normal)) - 1.0;
    // tint.cpp shades sRGB numbers; light goes by about their square.
    vec3 shade = max(1.0 + vec3(0.86, 0.80, 0.66) * off, 0.0);
    vec3 colour = tint_of(height_share) * shade * shade;
    if (kWithHaze) colour = hazy(colour, relative_m, haze_density);
    fragment_colour = vec4(colour, 1.0);
}
