// The twin of RelativeFrame::position (runtime/view/relative_frame.h), bit for bit: one integer subtraction, one
// multiplication, one subtraction for each axis. `precise` forbids a fused multiply-add, which would round differently.
// All these integers are exact or round alike in every tile, so tiles that share a vertex share its position.
layout(location = kAnchorUniform) uniform ivec3 anchor;
layout(location = kSpacingUniform) uniform float spacing_m;
layout(location = kQuantumUniform) uniform float quantum_m;
layout(location = kFractionUniform) uniform vec3 fraction_m;

// Metres from the eye (x east, y north, z up) of lattice vertex {i east, j south} at height_n quanta.
vec3 relative_position(ivec2 vertex, float height_n) {
    precise vec3 position;
    position.x = float(vertex.x - anchor.x) * spacing_m - fraction_m.x;
    position.y = float(anchor.y - vertex.y) * spacing_m - fraction_m.y;
    position.z = (height_n - float(anchor.z)) * quantum_m - fraction_m.z;
    return position;
}
