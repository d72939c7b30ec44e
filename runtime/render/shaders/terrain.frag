// Imagery (imagery_texel(), of one of three files), then haze. kWithHaze and kColourByLevel are set when the program is
// built.
in vec3 relative_m;
in float haze_density;
flat in int tile_step;

out vec4 fragment_colour;

vec3 level_colour() {
    float level = float(findMSB(tile_step));
    return 0.5 + 0.5 * cos(2.4 * level + vec3(0.0, 2.1, 4.2));
}

void main() {
    vec4 texel = imagery_texel();
    // Alpha 0 means "no heights here". Such texels decode to black, so filtering premultiplies: divide by what is there.
    if (texel.a < 0.5) discard;
    vec3 colour = texel.rgb / texel.a;
    if (kColourByLevel) colour = mix(colour, level_colour(), 0.6);
    if (kWithHaze) colour = hazy(colour, relative_m, haze_density);
    fragment_colour = vec4(colour, 1.0);
}
