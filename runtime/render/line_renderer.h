// LineRenderer: straight lines over a picture: boxes, a frozen frustum, a profile's course. OpenGL thread only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <glm/glm.hpp>

#include "common/result.h"
#include "runtime/render/render_target.h"
#include "runtime/view/camera.h"

namespace scree {

struct LineSegment {
    glm::dvec3 from{0}, to{0};  ///< metres in the dataset's CRS, as drawn (on a flat world or lowered already)
    std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};  ///< sRGB, not premultiplied
};

class LineRenderer {
public:
    /// Needs a current GlContext. Errors (ErrorCode::display): a shader does not compile.
    static Result<std::unique_ptr<LineRenderer>> create();
    ~LineRenderer();
    LineRenderer(const LineRenderer&) = delete;
    LineRenderer& operator=(const LineRenderer&) = delete;

    /// Draws over what `target` shows, `width_px` wide whatever the distance (smooth-edged). Where the picture's ground
    /// is in front, lines show at `hidden_share` of their opacity. Lengths beyond 1e9 m and ends behind the eye are
    /// clipped exactly; positions are relative to the eye in double precision before they become floats.
    void draw(const Camera& camera, std::span<const LineSegment> lines, double width_px, double hidden_share,
              RenderTarget& target);

private:
    struct State;
    explicit LineRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace scree
