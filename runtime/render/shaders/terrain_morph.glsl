// The twins of vertex_morph and morphed_height (common/mesh/morphed_vertex.h), bit for bit. kTileSamples (m + 1) is set when
// the program is built.
layout(location = kPatternAttribute) in ivec2 pattern;
layout(location = kMorphAttribute) in float inner_morph;
layout(location = kEdgeMorphAttribute) in vec4 edge_morph;

const int kTileCells = kTileSamples - 1;

// {weight, squared reach in samples, rim weight} of vertex {i, j} of the tile.
vec3 vertex_morph(ivec2 vertex) {
    bool north = vertex.y == 0, east = vertex.x == kTileCells, south = vertex.y == kTileCells, west = vertex.x == 0;
    float weight = north ? edge_morph.x : east ? edge_morph.y : south ? edge_morph.z : west ? edge_morph.w : inner_morph;
    int edge = north ? 1 : east ? 2 : south ? 4 : west ? 8 : 0;
    int stride = (pattern.y & edge) != 0 ? 2 * pattern.x : pattern.x;
    bool corner = (north || south) && (east || west);
    // Born at this stride: not on the grid of twice the stride.
    ivec2 off_grid = vertex & (2 * stride - 1);
    if (corner || (off_grid.x | off_grid.y) != stride) return vec3(0.0);
    precise float reach_squared = float(off_grid.x == off_grid.y ? 2 * stride * stride : stride * stride);
    if (edge != 0 || off_grid.x == off_grid.y) return vec3(weight, reach_squared, 0.0);
    // One stride from a thinned border, half-way to a vertex that moves along it: goes with it.
    ivec2 far = ivec2(kTileCells) - vertex;
    int near = vertex.y == stride ? 1 : far.x == stride ? 2 : far.y == stride ? 4 : vertex.x == stride ? 8 : 0;
    int along = (near & 5) != 0 ? vertex.x : vertex.y;
    if ((pattern.y & near) == 0 || (along & (4 * stride - 1)) != 2 * stride) return vec3(weight, reach_squared, 0.0);
    float rim = near == 1 ? edge_morph.x : near == 2 ? edge_morph.y : near == 4 ? edge_morph.z : edge_morph.w;
    precise vec2 moved = vec2(reach_squared * (1.0 + 2.0 * rim), weight * rim);
    return vec3(weight, moved);
}

float morphed_height(vec3 heights_n, vec3 morph) {
    precise float height_n = heights_n.x * (1.0 - morph.x) + heights_n.y * morph.x + heights_n.z * morph.z;
    return height_n;
}
