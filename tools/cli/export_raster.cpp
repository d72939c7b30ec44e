#include "tools/cli/export_raster.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <vector>

#include "common/progress.h"
#include "common/report.h"
#include "tools/partial_file.h"

namespace scree {
namespace {

constexpr std::int64_t kBlock = GeotiffWriter::kBlock;

Result<void> check_absent(const std::string& path, bool force) {
    std::error_code ignored;
    if (path.empty() || force || !std::filesystem::exists(path, ignored)) return {};
    return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", path)};
}

// Blocks from the north-west, row by row; the number of absent samples.
Result<std::int64_t> write_blocks(GeotiffWriter& writer, const GeotiffLayout& layout, const FillBlock& fill,
                                  Progress& progress) {
    std::vector<std::uint8_t> samples(writer.block_bytes());
    std::int64_t absent = 0;
    for (std::int64_t row = 0; row * kBlock < layout.height; ++row)
        for (std::int64_t column = 0; column * kBlock < layout.width; ++column) {
            if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
            const std::int64_t columns = std::min(kBlock, layout.width - column * kBlock),
                               rows = std::min(kBlock, layout.height - row * kBlock);
            std::fill(samples.begin(), samples.end(), std::uint8_t{0});
            auto missing = fill(column * kBlock, row * kBlock, columns, rows, samples);
            if (!missing) return missing.error();
            absent += *missing;
            if (auto ok = writer.write_block(column, row, samples); !ok) return ok.error();
            progress.add(static_cast<double>(columns * rows) / 1e6);
        }
    return absent;
}

Result<void> give_name(PartialFile& partial, const std::string& out, const std::string& sidecar,
                       const std::string& projection) {
    if (::fsync(partial.descriptor()) != 0)
        return Error{ErrorCode::io, fmt::format("{}: {}", partial.path(), std::strerror(errno))};
    if (!sidecar.empty())
        if (auto ok = write_text(sidecar, projection); !ok) return ok;
    auto renamed = partial.rename_to(out);
    if (!renamed && !sidecar.empty()) std::remove(sidecar.c_str());
    return renamed;
}

}  // namespace

ExportBox whole_extent(const Lattice& l) {
    return {l.origin_x_m, l.y_m(static_cast<double>(l.cells_y)), l.x_m(static_cast<double>(l.cells_x)), l.origin_y_m};
}

Result<RasterReport> write_raster(const RasterExport& options, const GeotiffLayout& layout, const FillBlock& fill) {
    RasterReport report;
    report.layout = layout;
    const std::string projection = layout.crs ? geotiff_sidecar(*layout.crs) : std::string();
    if (!projection.empty()) report.sidecar = std::filesystem::path(options.out).replace_extension(".prj").string();
    for (const std::string& file : {options.out, report.sidecar})
        if (auto ok = check_absent(file, options.force); !ok) return ok.error();
    auto partial = PartialFile::create(options.out + ".partial");
    if (!partial) return partial.error();
    auto writer = GeotiffWriter::create((*partial)->path(), layout);
    if (!writer) return writer.error();
    Progress progress("export", "MPix", options.quiet);
    progress.set_total(static_cast<double>(layout.width) * static_cast<double>(layout.height) / 1e6);
    auto absent = write_blocks(**writer, layout, fill, progress);
    if (!absent) return absent.error();
    report.absent = *absent;
    if (auto ok = (*writer)->finish(); !ok) return ok.error();
    if (auto ok = give_name(**partial, options.out, report.sidecar, projection); !ok) return ok.error();
    progress.finish();
    std::error_code ignored;
    report.bytes = static_cast<std::int64_t>(std::filesystem::file_size(options.out, ignored));
    return report;
}

}  // namespace scree
