#include "runtime/app/pose_pictures.h"

#include "common/report.h"
#include "runtime/app/display.h"

namespace scree {

Result<std::vector<PosePicture>> draw_poses(const SqliteStore& store, const ViewOptions& o, const FlightPath& path) {
    auto scene = Scene::open(store, scene_options(o));
    if (!scene) return scene.error();
    auto display = Display::create(**scene, {o.width_px, o.height_px});
    if (!display) return display.error();
    if (auto ok = (*scene)->start(**display); !ok) return ok.error();
    std::vector<PosePicture> pictures;
    for (const std::size_t k : pictured_frames(path.size())) {
        auto camera = camera_of(path[k], o);
        if (!camera) return camera.error();
        auto frame = (*scene)->complete({&*camera, 1}, [] { return interrupt_flag().load(); });
        if (!frame) return frame.error();
        (*display)->draw(*camera, frame->selection->to_render(0), frame->half_curvature);
        const PagePicture drawn{o.width_px, o.height_px, (*display)->target().read_pixels()};
        pictures.push_back({k, reduced(drawn, kPictureWidth_px)});
    }
    return pictures;
}

}  // namespace scree
