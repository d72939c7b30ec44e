// Noise of one 8-bit step hides the bands that a slow gradient shows: Jimenez, "Next generation post processing in Call of
// Duty: Advanced Warfare" (2014), interleaved gradient noise. A step of sRGB is about 2 sqrt(c) / 255 of linear light.
vec3 dithered(vec3 colour) {
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    return colour + (noise - 0.5) * 2.0 / 255.0 * sqrt(colour);
}
