// The twins of RelativeFrame::position and morph_reach_m2 (runtime/view/relative_frame.h), bit for bit. `precise` forbids a
// fused multiply-add, which would round differently. Lattice and height integers are exact or round alike in every tile,
// so tiles that share a vertex and its morph share its position.
layout(location = kAnchorUniform) uniform ivec3 anchor;
layout(location = kSpacingUniform) uniform float spacing_m;
layout(location = kQuantumUniform) uniform float quantum_m;
layout(location = kFractionUniform) uniform vec3 fraction_m;
layout(location = kHalfCurvatureUniform) uniform float half_curvature;

// Metres from the eye (x east, y north, z up) of lattice vertex {i east, j south} at height_n quanta on a flat world.
vec3 flat_position(ivec2 vertex, float height_n) {
    precise vec3 position;
    position.x = float(vertex.x - anchor.x) * spacing_m - fraction_m.x;
    position.y = float(anchor.y - vertex.y) * spacing_m - fraction_m.y;
    position.z = (height_n - float(anchor.z)) * quantum_m - fraction_m.z;
    return position;
}

// How far the earth's curvature lowers it.
float curvature_drop(vec3 position, float morph_reach_m2) {
    precise float drop = (position.x * position.x + position.y * position.y + morph_reach_m2) * half_curvature;
    return drop;
}

float morph_reach_m2(float weight, float reach_squared, int step) {
    precise float side_m = float(step) * spacing_m;
    precise float reach_m2 = weight * (reach_squared * (side_m * side_m));
    return reach_m2;
}

vec3 curved_position(vec3 flat_m, float drop_m) {
    precise float z = flat_m.z - drop_m;
    return vec3(flat_m.xy, z);
}
