#include "tools/cli/export_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>

#include "common/report.h"
#include "common/store/byte_io.h"
#include "common/store/sqlite_store.h"

namespace scree {
namespace {

std::optional<TileId> parse_tile(const std::string& text) {
    TileId id;
    const char *p = text.data(), *end = p + text.size();
    auto r = std::from_chars(p, end, id.level);
    if (r.ec != std::errc{} || r.ptr == end || *r.ptr != '/') return std::nullopt;
    r = std::from_chars(r.ptr + 1, end, id.x);
    if (r.ec != std::errc{} || r.ptr == end || *r.ptr != '/') return std::nullopt;
    r = std::from_chars(r.ptr + 1, end, id.y);
    if (r.ec != std::errc{} || r.ptr != end) return std::nullopt;
    return id;
}

// DirectDraw Surface, 124-byte header, FourCC DXT1, whole mip chain finest first.
std::string dds_of(const TextureTile& tile, int size_log2) {
    std::vector<std::uint8_t> bytes;
    ByteWriter out(bytes);
    const std::uint32_t size = 1u << size_log2;
    constexpr std::uint32_t kCaps = 1, kHeight = 2, kWidth = 4, kPixelFormat = 0x1000, kMipCount = 0x20000,
                            kLinearSize = 0x80000;
    constexpr std::uint32_t kFourCc = 4, kTexture = 0x1000, kComplex = 8, kMipMap = 0x400000;
    out.u32(0x20534444);  // "DDS "
    out.u32(124);
    out.u32(kCaps | kHeight | kWidth | kPixelFormat | kMipCount | kLinearSize);
    out.u32(size);
    out.u32(size);
    out.u32(static_cast<std::uint32_t>(bc1_mip_bytes(size_log2, 0)));
    out.u32(0);
    out.u32(static_cast<std::uint32_t>(mip_count(size_log2)));
    for (int k = 0; k < 11; ++k) out.u32(0);
    out.u32(32);
    out.u32(kFourCc | 1);  // the blocks may use the transparent index
    out.u32(0x31545844);   // "DXT1"
    for (int k = 0; k < 5; ++k) out.u32(0);
    out.u32(kTexture | kComplex | kMipMap);
    for (int k = 0; k < 4; ++k) out.u32(0);
    for (int mip = 0; mip <= size_log2; ++mip)
        out.bytes({tile.blocks.data() + bc1_mip_offset(size_log2, mip), bc1_mip_bytes(size_log2, mip)});
    return {bytes.begin(), bytes.end()};
}

}  // namespace

int run_export(int argc, char** argv) {
    CLI::App app{"Writes part of a store as a file of a common format.", "scree export"};
    std::string path, texture, out, json;
    bool force = false;
    app.add_option("STORE", path, "A .scree file")->required();
    app.add_option("--texture", texture, "Texture tile LEVEL/X/Y as DDS (DXT1 with its mips)")->required();
    app.add_option("-o,--output", out, "The file to write")->required();
    app.add_flag("--force", force, "Replace an existing file");
    app.add_option("--json", json, "Write the report as JSON to a file, or - for standard output");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    const auto id = parse_tile(texture);
    if (!id)
        return report_error("scree export", {ErrorCode::usage, fmt::format("--texture {} is not LEVEL/X/Y", texture)});
    std::error_code error;
    if (std::filesystem::exists(out, error) && !force)
        return report_error("scree export", {ErrorCode::usage, fmt::format("{}: exists; --force replaces it", out)});
    auto store = SqliteStore::open(path);
    if (!store) return report_error("scree export", store.error());
    const Dataset& d = (*store)->dataset();
    auto reader = (*store)->open_reader();
    if (!reader) return report_error("scree export", reader.error());
    TileRow row;
    auto found = (*reader)->read(TileKind::texture, *id, row);
    if (!found) return report_error("scree export", found.error());
    if (!*found)
        return report_error("scree export", {ErrorCode::input, fmt::format("{}: no texture tile {}; levels are 0..{}",
                                                                           path, texture, d.texture_deepest_level)});
    auto tile = read_texture_tile(**reader, d, *id);
    if (!tile) return report_error("scree export", tile.error());
    const std::string dds = dds_of(*tile, d.texture_size_log2);
    if (auto ok = write_text(out, dds); !ok) return report_error("scree export", ok.error());
    if (!json.empty()) {
        const std::string text =
            fmt::format("{{\n  \"bytes\": {},\n  \"size_px\": {}\n}}\n", dds.size(), d.texture_size());
        if (auto ok = write_text(json, text); !ok) return report_error("scree export", ok.error());
    }
    return 0;
}

}  // namespace scree
