// The numbers that C++ and GLSL must agree on, as C++ sees them: scree::shader::kHeightAttribute and so on.
#pragma once

namespace scree::shader {

#include "runtime/render/shaders/shared_constants.glsl"

}  // namespace scree::shader
