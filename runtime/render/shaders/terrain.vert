// One tile vertex. kTileSamples (m + 1), SCREE_BLENDED for draws that look at several textures, and SCREE_HIGHLIGHT for
// frames whose tiles are coloured, are set when the program is built.
layout(location = kHeightAttribute) in vec3 heights_n;
layout(location = kTileAttribute) in ivec4 tile;
layout(location = kTextureAttribute) in vec4 placement;

layout(location = kClipFromRelativeUniform) uniform mat4 clip_from_relative;

// Programs meet along edges of tiles and within them: all must come to the same bits.
invariant gl_Position;

out vec3 relative_m;
out float haze_density;  // mean over the ray; so nearly linear over a triangle that it need not be worked out per pixel
out vec2 texture_position;

#ifdef SCREE_HIGHLIGHT
layout(location = kHighlightAttribute) in vec4 highlight_srgb;
flat out vec3 highlight;
#endif

#ifndef SCREE_BLENDED
flat out float texture_layer;
#else
layout(location = kCoarseAttribute) in vec4 coarse;
layout(location = kCodesAttribute) in uvec2 codes;
layout(location = kNeighboursAttribute) in uvec4 neighbours;

out vec2 coarse_position;
flat out float texture_share;
flat out uint own_texture;
flat out uint coarse_texture;
flat out uvec4 neighbour_textures;
#endif

void main() {
    int local = gl_VertexID - tile.w;
    ivec2 sample_index = ivec2(local % kTileSamples, local / kTileSamples);
    vec3 morph = vertex_morph(sample_index);
    vec3 flat_m = flat_position(tile.xy + sample_index * tile.z, morphed_height(heights_n, morph));
    relative_m = curved_position(flat_m, curvature_drop(flat_m, morph_reach_m2(morph.x, morph.y, tile.z)));
    haze_density = mean_haze_density(flat_m.z);  // air follows the curve of the ground
    vec2 tile_position = vec2(sample_index) / float(kTileCells);
    texture_position = placement.zw + placement.y * tile_position;
#ifdef SCREE_HIGHLIGHT
    highlight = linear_of(highlight_srgb.rgb);
#endif
#ifndef SCREE_BLENDED
    texture_layer = placement.x;
#else
    coarse_position = coarse.yz + coarse.x * tile_position;
    texture_share = coarse.w;
    own_texture = codes.x;
    coarse_texture = codes.y;
    neighbour_textures = neighbours;
#endif
    gl_Position = clip_from_relative * vec4(relative_m, 1.0);
}
