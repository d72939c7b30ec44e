// The colour of sky and haze, one definition for both, so that the far ground fades into exactly the sky behind it. All
// colours are linear; the framebuffer encodes them as sRGB.
layout(location = kSunUniform) uniform vec3 sun_direction;

// Haze thins exponentially with height over the ground plane that stands in for the world beyond the data:
// x extinction at that plane, 1/m (0: no haze); y 1/m, inverse of the scale height; z eye above the plane, m, at least 1;
// w density at the eye, exp(-z * y).
layout(location = kHazeUniform) uniform vec4 haze;

const vec3 kZenith = vec3(0.040, 0.150, 0.460);
const vec3 kHorizon = vec3(0.590, 0.690, 0.790);
const vec3 kGround = vec3(0.050, 0.082, 0.112);
const vec3 kSunlight = vec3(1.000, 0.860, 0.640);

// Plain multiplications stand in for pow() and exp(): on software OpenGL the sky costs what it computes.
float fourth_power(float x) {
    float square = x * x;
    return square * square;
}

// The horizon's colour in a direction that lies at cosine `towards` (>= 0) of the sun: brighter and warmer near it.
vec3 horizon_colour(float towards) {
    float wide = fourth_power(towards);
    return kHorizon + kSunlight * (0.22 * wide * wide);
}

float towards_sun(vec3 direction) { return max(dot(direction, sun_direction), 0.0); }

// Mean density of the haze over a ray that ends `rise_m` above the eye.
float mean_haze_density(float rise_m) {
    float rise = rise_m * haze.y;
    float density_there = exp(-max((haze.z + rise_m) * haze.y, 0.0));
    // The quotient cancels for level rays; there its first two terms err by rise^2 / 6 < 2e-5.
    return abs(rise) < 1e-2 ? haze.w * (1.0 - 0.5 * rise) : (haze.w - density_there) / rise;
}

// What is seen of a colour at the end of a ray. Air scatters blue before red: what is far turns blue, then pale.
vec3 hazy(vec3 colour, vec3 ray_m, float mean_density) {
    float distance_m = length(ray_m);
    vec3 horizon = horizon_colour(towards_sun(ray_m / distance_m));
    // Extinction 3/4, 1 and 5/4 of the mean, of one exponential.
    float quarter = exp(-0.25 * mean_density * distance_m * haze.x);
    float square = quarter * quarter;
    return mix(horizon, colour, quarter * square * vec3(1.0, quarter, square));
}

vec3 sky_colour(vec3 direction) {
    float towards = towards_sun(direction);
    vec3 horizon = horizon_colour(towards);
    // Below the horizon the ray meets the ground plane; mean density times distance is (1 - haze.w) / (haze.y * -z).
    if (direction.z < 0.0) {
        float depth = (1.0 - haze.w) * haze.x / (haze.y * max(-direction.z, 1e-6));
        // As still water would, the plane mirrors the sky the more the flatter it is seen.
        float flat_seen = 1.0 + direction.z;
        vec3 ground = mix(kGround, horizon, 0.85 * flat_seen * flat_seen * flat_seen);
        return mix(horizon, ground, exp(-depth));
    }
    float near_sun = fourth_power(fourth_power(towards));         // ^16
    float glow = fourth_power(near_sun) * near_sun * near_sun;    // ^96: a few degrees
    float core = fourth_power(glow) * fourth_power(glow);         // ^768; its square: a degree or two
    float disc = clamp((towards - 0.99985) * 10000.0, 0.0, 1.0);  // half a degree across
    vec3 sky = mix(kZenith, horizon, fourth_power(1.0 - direction.z));
    return sky + kSunlight * (0.35 * glow + 0.6 * core * core + 4.0 * disc);
}
