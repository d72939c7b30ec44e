#include "runtime/app/picture_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <system_error>
#include <utility>

#include "runtime/render/png.h"

namespace scree {

Result<std::filesystem::path> next_free_file(const std::filesystem::path& folder, const std::string& name,
                                             const std::string& extension, int& first) {
    constexpr int kNumbers = 9999;
    for (int number = std::max(first, 1); number <= kNumbers; ++number) {
        const std::filesystem::path file = folder / fmt::format("scree-{}-{:03}.{}", name, number, extension);
        std::error_code trouble;
        // A link to nowhere is a name that is taken.
        const auto status = std::filesystem::symlink_status(file, trouble);
        if (status.type() == std::filesystem::file_type::not_found) {
            first = number + 1;
            return file;
        }
        if (trouble)
            return Error{ErrorCode::io,
                         fmt::format("{}: {}: nothing can be written there", file.string(), trouble.message())};
    }
    return Error{ErrorCode::io,
                 fmt::format("scree-{}-001.{} to {}: all taken; move them away", name, extension, kNumbers)};
}

void PictureWriter::write(const std::filesystem::path& file, int width_px, int height_px,
                          std::vector<std::uint8_t> rgb) {
    jobs_.push_back({file, std::async(std::launch::async, [=, on_done = on_done_, pixels = std::move(rgb)] {
                         Result<void> outcome = write_png(file, width_px, height_px, pixels);
                         if (on_done) on_done();
                         return outcome;
                     })});
}

std::vector<PictureWriter::Done> PictureWriter::take_done(bool all) {
    std::vector<Done> done;
    while (!jobs_.empty()) {
        Job& job = jobs_.front();
        if (!all && job.outcome.wait_for(std::chrono::seconds(0)) != std::future_status::ready) break;
        done.push_back({job.file, job.outcome.get()});
        jobs_.erase(jobs_.begin());
    }
    return done;
}

}  // namespace scree
