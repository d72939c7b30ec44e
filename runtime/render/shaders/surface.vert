// A vertex of an untextured surface.
layout(location = kSurfaceLatticeAttribute) in ivec2 lattice_vertex;
layout(location = kSurfaceHeightAttribute) in float height_n;
layout(location = kSurfaceNormalAttribute) in vec2 normal_across;

layout(location = kClipFromRelativeUniform) uniform mat4 clip_from_relative;
layout(location = kTintUniform) uniform vec2 tint;  // share of the heights' range: n * x + y

// Drawn once more where the ground ends.
invariant gl_Position;

out vec3 relative_m;
out float haze_density;  // mean over the ray, as in terrain.vert
out float height_share;
out vec3 normal;

void main() {
    vec3 flat_m = flat_position(lattice_vertex, height_n);
    relative_m = curved_position(flat_m, curvature_drop(flat_m, 0.0));
    haze_density = mean_haze_density(flat_m.z);
    height_share = height_n * tint.x + tint.y;
    normal = vec3(normal_across, sqrt(max(1.0 - dot(normal_across, normal_across), 0.0)));
    gl_Position = clip_from_relative * vec4(relative_m, 1.0);
}
