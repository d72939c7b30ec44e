// The end of the ground, dissolved: the sky and ground plane of the same direction, the more the nearer the ground ends.
// Blended over what is drawn already.
layout(location = kEdgeFieldUniform) uniform vec4 field_place;
layout(binding = kEdgeFieldUnit) uniform sampler2D edge_field;  // share of the band, 0 where the ground ends

in vec3 relative_m;

out vec4 fragment_colour;

void main() {
    float inside = texture(edge_field, relative_m.xy * field_place.xy + field_place.zw).r;
    fragment_colour = vec4(dithered(sky_colour(normalize(relative_m))), 1.0 - smoothstep(0.0, 1.0, inside));
}
