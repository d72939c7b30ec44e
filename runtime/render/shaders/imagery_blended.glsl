// Imagery of a draw that looks at several textures: neighbours where filtering reaches across its border, and a coarser one
// while its own is newly come. A pixel is a sum of taps: its own texture, up to three neighbours, the coarse texture.
// kTextureTexels (a side), kArrays (that the textures lie in) and kFading are set when the program is built.
//
// Textures have no border texels and clamp. Within half a texel of the border a bilinear filter wants texels of the
// neighbour too. Clamped, the hardware gives each texture's own part of that filter; the taps' weights are what is left of
// it. Both sides of a border come to the same sum.
layout(binding = kImageryTextureUnit) uniform sampler2DArray imagery[kArrays];

in vec2 texture_position;
in vec2 coarse_position;
flat in float texture_share;
flat in uint own_texture;
flat in uint coarse_texture;
flat in uvec4 neighbour_textures;

// Tap 0 is the own texture; 1 lies beside it, 2 above or below, 3 across the corner (bit 0: a step in x, bit 1: one in y).
const int kCoarseTap = 4;

struct Taps {
    int wanted;       // a bit each
    vec2 across;      // weight of a step in x and in y
    ivec2 direction;  // of those steps
    vec2 own_dx, own_dy, coarse_dx, coarse_dy;
};

struct Sums {
    vec4 fine;
    float fine_weight;
    vec4 coarse;
};

ivec2 steps_of(int tap) { return ivec2(tap, tap >> 1) & 1; }

uint texture_of(Taps taps, int tap) {
    if (kFading && tap == kCoarseTap) return coarse_texture;
    ivec2 steps = taps.direction * steps_of(tap);
    int place = 3 * steps.y + steps.x + 4;
    int side = max(place - (place > 4 ? 1 : 0), 0);  // the middle is no neighbour
    uint neighbour = neighbour_textures[side >> 1] >> (16 * (side & 1)) & uint(kNoTexture);
    return tap == 0 ? own_texture : neighbour;
}

Taps find_taps() {
    Taps taps;
    taps.own_dx = dFdx(texture_position);
    taps.own_dy = dFdy(texture_position);
    taps.coarse_dx = dFdx(coarse_position);
    taps.coarse_dy = dFdy(coarse_position);
    // Minified, the filter reaches as far as the texels of the mip that is drawn.
    float texels_a_pixel = kTextureTexels * sqrt(max(dot(taps.own_dx, taps.own_dx), dot(taps.own_dy, taps.own_dy)));
    float texels = kTextureTexels / max(texels_a_pixel, 1.0);
    taps.across = max(0.5 - texels * min(texture_position, 1.0 - texture_position), 0.0);
    taps.direction = ivec2(texture_position.x < 0.5 ? -1 : 1, texture_position.y < 0.5 ? -1 : 1);
    bool in_x = taps.across.x > 0.0, in_y = taps.across.y > 0.0;
    taps.wanted = 1 | (in_x ? 2 : 0) | (in_y ? 4 : 0) | (in_x && in_y ? 8 : 0);
    if (kFading) taps.wanted |= texture_share < 1.0 ? 1 << kCoarseTap : 0;
    return taps;
}

// The wanted taps of the array bound to `unit`.
int taps_of_unit(Taps taps, int unit) {
    int mine = 0;
    for (int tap = 0; tap <= kCoarseTap; ++tap)
        mine |= int(texture_of(taps, tap) >> kTextureLayerBits) == unit ? 1 << tap : 0;
    return taps.wanted & mine;
}

// A loop in place of ifs: software OpenGL runs both sides of an if but leaves a loop when all its pixels do. Pixels of a
// quad may differ in their taps: gradients are explicit.
void add_taps(sampler2DArray array, Taps taps, int pending, inout Sums sums) {
    do {
        int tap = findLSB(pending);
        pending &= pending - 1;
        bool coarse = kFading && tap == kCoarseTap;
        vec2 steps = vec2(steps_of(tap));
        uint code = texture_of(taps, tap);
        float layer = float(code & uint(kTextureLayerMask));
        vec2 position = texture_position - vec2(taps.direction) * steps;
        vec4 texel = textureGrad(array, vec3(coarse ? coarse_position : position, layer),
                                 coarse ? taps.coarse_dx : taps.own_dx, coarse ? taps.coarse_dy : taps.own_dy);
        vec2 weights = abs(1.0 - steps - taps.across);
        // A neighbour that is not there leaves its weight to those that are.
        float weight = coarse || code == uint(kNoTexture) ? 0.0 : weights.x * weights.y;
        sums.fine += weight * texel;
        sums.fine_weight += weight;
        if (coarse) sums.coarse = texel;
    } while (pending != 0);
}

vec4 imagery_texel() {
    Taps taps = find_taps();
    Sums sums = Sums(vec4(0.0), 0.0, vec4(0.0));
    if (kArrays == 1) {
        add_taps(imagery[0], taps, taps.wanted, sums);
    } else {
        for (int unit = 0; unit < kArrays; ++unit) {
            int pending = taps_of_unit(taps, unit);
            if (pending != 0) add_taps(imagery[unit], taps, pending, sums);
        }
    }
    vec4 fine = sums.fine / sums.fine_weight;
    return kFading ? mix(sums.coarse, fine, texture_share) : fine;
}
