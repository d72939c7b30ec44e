// Valid as GLSL and as C++: every program starts with this file, and shader_constants.h includes it.

// Vertex attributes. The first advances by vertex, the other two by draw (divisor 1).
const int kHeightAttribute = 0;   // vec3: heights in quanta {own, next, second next}
const int kTileAttribute = 1;     // ivec4: lattice i, j of the north-west corner, cells between samples, first vertex
const int kTextureAttribute = 2;  // vec4: layer, scale, offset u, offset v

// Uniform locations.
const int kClipFromRelativeUniform = 0;  // mat4
const int kAnchorUniform = 1;            // ivec3: lattice i, j and height n nearest the eye
const int kSpacingUniform = 2;           // float: metres a cell
const int kQuantumUniform = 3;           // float: metres a height quantum
const int kFractionUniform = 4;          // vec3: eye minus the anchor's position, metres
const int kSunUniform = 5;               // vec3: unit direction towards the sun
const int kHazeUniform = 6;              // vec4: see atmosphere.glsl
const int kRayFromScreenUniform = 7;     // mat3: {x, y, 1} on the screen, -1..1, to a view ray (not normalised)

const int kImageryTextureUnit = 0;
