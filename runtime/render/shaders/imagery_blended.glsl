// Imagery of a draw that looks at several textures: neighbours where filtering reaches across its border, and a coarser one
// while its own is newly come. A pixel is a sum of taps: its own texture, up to three neighbours, the coarse texture.
// kTextureTexels (a side) and kTwoArrays are set when the program is built.
//
// Textures have no border texels and clamp. Within half a texel of the border a bilinear filter wants texels of the
// neighbour too. Clamped, the hardware gives each texture's own part of that filter; the taps' weights are what is left of
// it. Both sides of a border come to the same sum.
layout(binding = kImageryTextureUnit) uniform sampler2DArray imagery;
layout(binding = kOtherImageryTextureUnit) uniform sampler2DArray other_imagery;

in vec2 texture_position;
in vec2 coarse_position;
flat in float texture_layer;
flat in float texture_share;
flat in uint coarse_texture;
flat in uvec4 neighbour_textures;

// Tap 0 is the own texture; 1 lies beside it, 2 above or below, 3 across the corner (bit 0: a step in x, bit 1: one in y).
const int kCoarseTap = 4;

struct Taps {
    float own_weight;
    vec4 weights;     // of taps 1 to 4
    uvec4 textures;   // likewise
    vec2 direction;   // towards the nearest corner, -1 or 1 each
    vec2 own_dx, own_dy, coarse_dx, coarse_dy;
};

// The texture `direction` away (-1..1 each, not both 0).
uint neighbour_texture(ivec2 direction) {
    int place = 3 * direction.y + direction.x + 4;
    int side = place - (place > 4 ? 1 : 0);  // the middle is no neighbour
    return neighbour_textures[side >> 1] >> (16 * (side & 1)) & 0xffffu;
}

Taps find_taps() {
    Taps taps;
    taps.own_dx = dFdx(texture_position);
    taps.own_dy = dFdy(texture_position);
    taps.coarse_dx = dFdx(coarse_position);
    taps.coarse_dy = dFdy(coarse_position);
    // Minified, the filter reaches as far as the texels of the mip that is drawn.
    float texels_a_pixel =
        kTextureTexels * sqrt(max(dot(taps.own_dx, taps.own_dx), dot(taps.own_dy, taps.own_dy)));
    float texels = kTextureTexels / max(texels_a_pixel, 1.0);
    vec2 across = max(0.5 - texels * min(texture_position, 1.0 - texture_position), 0.0);
    ivec2 direction = ivec2(texture_position.x < 0.5 ? -1 : 1, texture_position.y < 0.5 ? -1 : 1);
    taps.direction = vec2(direction);
    taps.textures = uvec4(neighbour_texture(ivec2(direction.x, 0)), neighbour_texture(ivec2(0, direction.y)),
                          neighbour_texture(direction), coarse_texture);
    vec3 weights = vec3(across.x * (1.0 - across.y), (1.0 - across.x) * across.y, across.x * across.y);
    // A neighbour that is not there leaves its weight to those that are.
    weights = mix(weights, vec3(0.0), equal(taps.textures.xyz & uint(kNoTexture), uvec3(kNoTexture)));
    taps.own_weight = (1.0 - across.x) * (1.0 - across.y);
    float share = texture_share / (taps.own_weight + weights.x + weights.y + weights.z);
    taps.own_weight *= share;
    taps.weights = vec4(weights * share, 1.0 - texture_share);
    return taps;
}

// Sum of the taps whose bits are set in `pending`, all in one array. A loop in place of ifs: software OpenGL runs both sides
// of an if but leaves a loop when all its pixels do. Pixels of a quad may differ in their taps: gradients are explicit.
vec4 sum_of_taps(sampler2DArray array, Taps taps, int pending) {
    vec4 sum = vec4(0.0);
    do {
        int tap = findLSB(pending);
        pending &= pending - 1;
        bool coarse = tap == kCoarseTap;
        vec2 own_position = texture_position - taps.direction * vec2(tap & 1, tap >> 1 & 1);
        float weight = tap == 0 ? taps.own_weight : taps.weights[tap - 1];
        float layer = tap == 0 ? texture_layer : float(taps.textures[tap - 1] & uint(kTextureLayerMask));
        sum += weight * textureGrad(array, vec3(coarse ? coarse_position : own_position, layer),
                                    coarse ? taps.coarse_dx : taps.own_dx, coarse ? taps.coarse_dy : taps.own_dy);
    } while (pending != 0);
    return sum;
}

vec4 imagery_texel() {
    Taps taps = find_taps();
    ivec4 bits = mix(ivec4(0), ivec4(2, 4, 8, 16), greaterThan(taps.weights, vec4(0.0)));
    ivec4 elsewhere = mix(ivec4(0), bits, notEqual(taps.textures & uint(kInOtherArray), uvec4(0u)));
    bits -= elsewhere;
    vec4 texel = sum_of_taps(imagery, taps, 1 | bits.x | bits.y | bits.z | bits.w);
    if (kTwoArrays) {
        int pending = elsewhere.x | elsewhere.y | elsewhere.z | elsewhere.w;
        if (pending != 0) texel += sum_of_taps(other_imagery, taps, pending);
    }
    return texel;
}
