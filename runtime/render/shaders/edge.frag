// The end of the data, dissolved: the sky and ground plane of the same direction, the more the nearer the data's box ends.
// Blended over tiles that are drawn already.
layout(location = kBoxUniform) uniform vec4 box_m;       // west, south, east, north of the data, from the eye
layout(location = kBandUniform) uniform float per_band;  // 1 / the width of what dissolves, 1/m

in vec3 relative_m;

out vec4 fragment_colour;

void main() {
    vec2 inside_m = min(relative_m.xy - box_m.xy, box_m.zw - relative_m.xy);
    float inside = min(inside_m.x, inside_m.y) * per_band;
    if (inside >= 1.0) discard;
    fragment_colour = vec4(dithered(sky_colour(normalize(relative_m))), 1.0 - smoothstep(0.0, 1.0, inside));
}
