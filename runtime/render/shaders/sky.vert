// One triangle over the whole screen, at infinity (depth 0).
layout(location = kRayFromScreenUniform) uniform mat3 ray_from_screen;

out vec3 ray;

void main() {
    vec2 screen = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    ray = ray_from_screen * vec3(screen, 1.0);
    gl_Position = vec4(screen, 0.0, 1.0);
}
