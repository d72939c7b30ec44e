// Tints by height, bare rock where it is steep, sunlight, then haze. kWithHaze is set when the program is built.
in vec3 relative_m;
in float haze_density;
in float height_share;
in vec3 normal;

out vec4 fragment_colour;

const vec3 kLowland = vec3(0.110, 0.190, 0.065);
const vec3 kSlopes = vec3(0.290, 0.230, 0.110);
const vec3 kSummits = vec3(0.640, 0.620, 0.580);
const vec3 kRock = vec3(0.200, 0.175, 0.150);

void main() {
    vec3 up = normalize(normal);
    vec3 tint = height_share < 0.5 ? mix(kLowland, kSlopes, clamp(2.0 * height_share, 0.0, 1.0))
                                   : mix(kSlopes, kSummits, clamp(2.0 * height_share - 1.0, 0.0, 1.0));
    tint = mix(tint, kRock, smoothstep(0.25, 0.55, 1.0 - up.z));  // from 41 to 63 degrees
    vec3 colour = tint * (0.35 + 1.1 * max(dot(up, sun_direction), 0.0));
    if (kWithHaze) colour = hazy(colour, relative_m, haze_density);
    fragment_colour = vec4(colour, 1.0);
}
