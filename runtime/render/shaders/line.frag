// Opacity falls off over the pixel that the line's edge crosses.
layout(location = kLineUniform) uniform vec4 line;

in vec2 along_across_px;
flat in float length_px;
flat in vec4 colour;

out vec4 fragment_colour;

void main() {
    vec2 off = vec2(along_across_px.x - clamp(along_across_px.x, 0.0, length_px), along_across_px.y);
    // Thinner than a pixel: as faint as that.
    float half_width = max(line.z, 0.5);
    float share = clamp(half_width + 0.5 - length(off), 0.0, 1.0) * min(2.0 * line.z, 1.0);
    fragment_colour = vec4(colour.rgb, colour.a * share);
}
