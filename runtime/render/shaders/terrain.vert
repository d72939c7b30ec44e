// One tile vertex. kTileSamples (m + 1) is set when the program is built.
layout(location = kHeightAttribute) in vec3 heights_n;
layout(location = kTileAttribute) in ivec4 tile;
layout(location = kTextureAttribute) in vec4 placement;

layout(location = kClipFromRelativeUniform) uniform mat4 clip_from_relative;

out vec3 relative_m;
out float haze_density;  // mean over the ray; so nearly linear over a triangle that it need not be worked out per pixel
out vec2 texture_position;
flat out float texture_layer;
flat out int tile_step;

void main() {
    int local = gl_VertexID - tile.w;
    ivec2 sample_index = ivec2(local % kTileSamples, local / kTileSamples);
    relative_m = relative_position(tile.xy + sample_index * tile.z, heights_n.x);
    haze_density = mean_haze_density(relative_m.z);
    texture_position = placement.zw + placement.y * (vec2(sample_index) / float(kTileSamples - 1));
    texture_layer = placement.x;
    tile_step = tile.z;
    gl_Position = clip_from_relative * vec4(relative_m, 1.0);
}
