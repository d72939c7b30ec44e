// PictureWriter: pictures to files while the window goes on; and the names of files that a window makes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

/// "scree-NAME-001.png", or the next number from `first` on that no file in the folder has; leaves in `first` the one
/// after it, for files that are still being written. Errors (ErrorCode::io): the folder cannot
/// be looked into, or all 9999 numbers are taken.
Result<std::filesystem::path> next_free_file(const std::filesystem::path& folder, const std::string& name,
                                             const std::string& extension, int& first);

/// One thread calls; encoding and writing have threads of their own.
class PictureWriter {
public:
    /// `on_done`: called on a thread of its own when a picture is written (to wake a sleeping window).
    explicit PictureWriter(std::function<void()> on_done) : on_done_(std::move(on_done)) {}
    ~PictureWriter() = default;  ///< waits for what is being written
    PictureWriter(const PictureWriter&) = delete;
    PictureWriter& operator=(const PictureWriter&) = delete;

    /// `rgb` as of write_png().
    void write(const std::filesystem::path& file, int width_px, int height_px, std::vector<std::uint8_t> rgb);

    struct Done {
        std::filesystem::path file;
        Result<void> outcome;
    };
    /// What has ended since the last call, in the order of write(); `all`: waits for the rest.
    std::vector<Done> take_done(bool all = false);

private:
    struct Job {
        std::filesystem::path file;
        std::future<Result<void>> outcome;
    };
    std::function<void()> on_done_;
    std::vector<Job> jobs_;
};

}  // namespace scree
