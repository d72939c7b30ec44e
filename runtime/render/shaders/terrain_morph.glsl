// The twins of vertex_morph and morphed_height (common/mesh/morphed_vertex.h), bit for bit. kTileSamples (m + 1) is set when
// the program is built.
layout(location = kPatternAttribute) in ivec2 pattern;
layout(location = kMorphAttribute) in float inner_morph;
layout(location = kEdgeMorphAttribute) in vec4 edge_morph;

const int kTileCells = kTileSamples - 1;

// {weight, squared reach in samples} of vertex {i, j} of the tile.
vec2 vertex_morph(ivec2 vertex) {
    bool north = vertex.y == 0, east = vertex.x == kTileCells, south = vertex.y == kTileCells, west = vertex.x == 0;
    float weight = north ? edge_morph.x : east ? edge_morph.y : south ? edge_morph.z : west ? edge_morph.w : inner_morph;
    int edge = north ? 1 : east ? 2 : south ? 4 : west ? 8 : 0;
    int stride = (pattern.y & edge) != 0 ? 2 * pattern.x : pattern.x;
    bool corner = (north || south) && (east || west);
    // Born at this stride: not on the grid of twice the stride.
    ivec2 off_grid = vertex & (2 * stride - 1);
    if (corner || (off_grid.x | off_grid.y) != stride) return vec2(0.0);
    int reach_squared = stride * stride;
    return vec2(weight, float(off_grid.x == off_grid.y ? 2 * reach_squared : reach_squared));
}

float morphed_height(vec2 heights_n, float weight) {
    precise float height_n = heights_n.x * (1.0 - weight) + heights_n.y * weight;
    return height_n;
}
