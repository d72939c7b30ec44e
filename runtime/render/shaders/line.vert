// A line as a quad on the picture, a pixel wider all round than the line, for its smooth edge and round ends. Depth is
// linear on the picture, so that positions need no perspective division.
layout(location = kLineEndsAttribute) in vec4 ends_px;
layout(location = kLineDepthsAttribute) in vec2 depths;
layout(location = kLineColourAttribute) in vec4 srgb_opacity;

layout(location = kLineUniform) uniform vec4 line;  // width, height, half the line's width, opacity

out vec2 along_across_px;  // from the first end
flat out float length_px;
flat out vec4 colour;

void main() {
    vec2 course = ends_px.zw - ends_px.xy;
    length_px = length(course);
    vec2 along = length_px > 0.0 ? course / length_px : vec2(1.0, 0.0);
    vec2 across = vec2(-along.y, along.x);
    float reach = line.z + 1.0;
    bool end = (gl_VertexID & 1) != 0, left = (gl_VertexID & 2) != 0;
    along_across_px = vec2(end ? length_px + reach : -reach, left ? reach : -reach);
    vec2 place_px = ends_px.xy + along * along_across_px.x + across * along_across_px.y;
    float share = length_px > 0.0 ? along_across_px.x / length_px : 0.0;
    float depth = clamp(mix(depths.x, depths.y, share), 0.0, 1.0);
    colour = vec4(linear_of(srgb_opacity.rgb), srgb_opacity.a * line.w);
    gl_Position = vec4(2.0 * place_px / line.xy - 1.0, depth, 1.0);
}
