// Images that are open for reading pixels, few at a time: an open one holds a band of its rows and a decoder.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <vector>

#include "common/result.h"
#include "tools/mosaic/layer.h"
#include "tools/source/image_source.h"

namespace scree {

/// One thread at a time.
class OpenImages {
public:
    /// Opening a file costs milliseconds, holding it a band of it: more than that are wanted by turns only where a
    /// layer has more files side by side, and those are spooled.
    static constexpr std::size_t kMost = 8;

    OpenImages(const std::vector<PlacedFile>& files, const OpenOptions& options) : files_(files), options_(options) {}

    /// Opens it where it is not; the file that was used longest ago makes room. The pointer is good until the next
    /// call. Errors: those of opening, and ErrorCode::input where the file is not what it was when it was planned with.
    Result<ImageSource*> open(std::size_t file);
    bool is_open(std::size_t file) const;
    void close(std::size_t file);

private:
    struct Open {
        std::size_t file;
        std::unique_ptr<ImageSource> source;
    };
    const std::vector<PlacedFile>& files_;
    OpenOptions options_;
    std::list<Open> open_;  ///< last used first
};

}  // namespace scree
