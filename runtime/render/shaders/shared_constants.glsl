// Valid as GLSL and as C++: every program starts with this file, and shader_constants.h includes it.

// Vertex attributes. The first advances by vertex, the others by draw (divisor 1); three are of blended draws.
const int kHeightAttribute = 0;      // vec3: heights in quanta {own, next coarser, rim}: see SlotVertex
const int kTileAttribute = 1;        // ivec4: lattice i, j of the north-west corner, cells between samples, first vertex
const int kTextureAttribute = 2;     // vec4: layer, scale, offset u, offset v
const int kPatternAttribute = 3;     // ivec2: samples between vertices, edges thinned by 2 (EdgeMask)
const int kMorphAttribute = 4;       // float: weight of inner vertices
const int kEdgeMorphAttribute = 5;   // vec4: weights of the north, east, south and west edge's vertices
const int kCoarseAttribute = 6;      // vec4: scale, offset u, offset v of the coarse texture, share of the own one
const int kCodesAttribute = 7;       // uvec2: texture codes of the own and of the coarse texture
const int kNeighboursAttribute = 8;  // uvec4: codes of the textures round the own one, two to a word, by TextureSide
const int kHighlightAttribute = 9;   // vec4: sRGB colour of a highlighted draw

// Of an untextured surface (SurfaceVertex), all by vertex.
const int kSurfaceLatticeAttribute = 0;  // ivec2: lattice i, j
const int kSurfaceHeightAttribute = 1;   // float: quanta
const int kSurfaceNormalAttribute = 2;   // vec2: east and north parts of the unit normal

// Of a line, all by line.
const int kLineEndsAttribute = 0;    // vec4: its ends on the picture, pixels from the lower left corner
const int kLineDepthsAttribute = 1;  // vec2: their depths
const int kLineColourAttribute = 2;  // vec4: sRGB and opacity

// How 16 bits name a texture of a blended draw: the unit that its array is bound to, then its layer there.
const int kTextureLayerBits = 11;
const int kTextureLayerMask = 0x7ff;
const int kNoTexture = 0xffff;
const int kMaxBlendedArrays = 31;

// Uniform locations.
const int kClipFromRelativeUniform = 0;  // mat4
const int kAnchorUniform = 1;            // ivec3: lattice i, j and height n nearest the eye
const int kSpacingUniform = 2;           // float: metres a cell
const int kQuantumUniform = 3;           // float: metres a height quantum
const int kFractionUniform = 4;          // vec3: eye minus the anchor's position, metres
const int kSunUniform = 5;               // vec3: unit direction towards the sun
const int kHazeUniform = 6;              // vec4: see atmosphere.glsl
const int kRayFromScreenUniform = 7;     // mat3: {x, y, 1} on the screen, -1..1, to a view ray (not normalised)
const int kHalfCurvatureUniform = 8;     // float: 1 / (2 R), 1/m; 0: flat
const int kTintUniform = 9;              // vec2: share of a surface's range of heights, n * x + y
const int kLineUniform = 10;             // vec4: the picture's size in pixels, half a line's width, share of its opacity
const int kEdgeFieldUniform = 11;        // vec4: place in an EdgeField's texture, relative_m.xy * xy + zw
const int kTintColoursUniform = 12;      // vec3[kTintColours]: a surface's colours over its range of heights, linear

const int kTintColours = 32;
const int kImageryTextureUnit = 0;  // and those after it, in blended draws
const int kEdgeFieldUnit = 0;       // in draws of their own
