// Imagery (imagery_texel(), of one of three files), then haze. kWithHaze, and SCREE_HIGHLIGHT for tiles that are
// coloured, are set when the program is built.
in vec3 relative_m;
in float haze_density;

out vec4 fragment_colour;

#ifdef SCREE_HIGHLIGHT
flat in vec3 highlight;

// The imagery in grey, so that only the tile's colour has a hue.
vec3 highlighted(vec3 colour) { return mix(vec3(dot(colour, vec3(0.2126, 0.7152, 0.0722))), highlight, 0.65); }
#else
vec3 highlighted(vec3 colour) { return colour; }
#endif

void main() {
    vec4 texel = imagery_texel();
    // Alpha 0 means "no heights here". Such texels decode to black, so filtering premultiplies: divide by what is there.
    if (texel.a < 0.5) discard;
    vec3 colour = texel.rgb / texel.a;
    colour = highlighted(colour);
    if (kWithHaze) colour = hazy(colour, relative_m, haze_density);
    fragment_colour = vec4(colour, 1.0);
}
