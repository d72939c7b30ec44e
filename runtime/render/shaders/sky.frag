in vec3 ray;

out vec4 fragment_colour;

void main() { fragment_colour = vec4(dithered(sky_colour(normalize(ray))), 1.0); }
