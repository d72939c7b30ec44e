// Imagery of a draw with one texture; see imagery_faded.glsl and imagery_blended.glsl for others.
layout(binding = kImageryTextureUnit) uniform sampler2DArray imagery;

in vec2 texture_position;
flat in float texture_layer;

vec4 imagery_texel() { return texture(imagery, vec3(texture_position, texture_layer)); }
