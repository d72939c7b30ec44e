// Imagery of a draw whose texture is newly come, away from its borders: a coarser one fades into it.
layout(binding = kImageryTextureUnit) uniform sampler2DArray imagery[2];  // the arrays of the own and the coarse texture

in vec2 texture_position;
in vec2 coarse_position;
flat in float texture_share;
flat in uint own_texture;
flat in uint coarse_texture;

float layer_of(uint code) { return float(code & uint(kTextureLayerMask)); }

// Both are premultiplied, so what is absent in one of them fades too.
vec4 imagery_texel() {
    vec4 fine = texture(imagery[0], vec3(texture_position, layer_of(own_texture)));
    vec4 coarse = texture(imagery[1], vec3(coarse_position, layer_of(coarse_texture)));
    return mix(coarse, fine, texture_share);
}
