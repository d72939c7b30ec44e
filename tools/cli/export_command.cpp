#include "tools/cli/export_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "common/store/byte_io.h"
#include "common/store/sqlite_store.h"
#include "tools/cli/export_raster.h"
#include "tools/source/number_text.h"

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

Result<std::string> texture_as_dds(const SqliteStore& store, TileId id) {
    const Dataset& d = store.dataset();
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    TileRow row;
    auto found = (*reader)->read(TileKind::texture, id, row);
    if (!found) return found.error();
    if (!*found)
        return Error{ErrorCode::input, fmt::format("{}: no texture tile {}/{}/{}; levels are 0..{}", store.path(),
                                                   id.level, id.x, id.y, d.texture_deepest_level)};
    auto tile = read_texture_tile(**reader, d, id);
    if (!tile) return tile.error();
    return dds_of(*tile, d.texture_size_log2);
}

Result<std::string> export_texture(const std::string& path, const std::string& texture, const std::string& out,
                                   bool force) {
    const auto id = parse_tile(texture);
    if (!id) return Error{ErrorCode::usage, fmt::format("--texture {} is not LEVEL/X/Y", texture)};
    std::error_code error;
    if (std::filesystem::exists(out, error) && !force)
        return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", out)};
    auto store = SqliteStore::open(path);
    if (!store) return store.error();
    auto dds = texture_as_dds(**store, *id);
    if (!dds) return dds.error();
    if (auto ok = write_text(out, *dds); !ok) return ok.error();
    return fmt::format("{{\n  \"bytes\": {},\n  \"size_px\": {}\n}}\n", dds->size(),
                       (*store)->dataset().texture_size());
}

const char* name_of(SampleType type) {
    return type == SampleType::u8    ? "uint8"
           : type == SampleType::i16 ? "int16"
           : type == SampleType::i32 ? "int32"
           : type == SampleType::f32 ? "float32"
                                     : "float64";
}

std::string to_json(const RasterReport& r, double seconds) {
    using Json = nlohmann::ordered_json;
    const GeotiffLayout& l = r.layout;
    Json out = {{"size", {l.width, l.height}},  {"type", name_of(l.type)},
                {"channels", l.channels},       {"level", r.level},
                {"origin_m", {l.x, l.y}},       {"step_m", {l.step_x, l.step_y}},
                {"absent", r.absent},           {"bytes", r.bytes},
                {"projection_file", r.sidecar}, {"seconds", seconds}};
    if (l.nodata) out["nodata"] = *l.nodata;
    return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<std::string> export_part(const std::string& path, const RasterExport& options, bool heights) {
    const auto start = std::chrono::steady_clock::now();
    auto store = SqliteStore::open(path);
    if (!store) return store.error();
    auto report = heights ? export_heights(**store, options) : export_imagery(**store, options);
    if (!report) return report.error();
    return to_json(*report, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

Result<ExportBox> parse_box(const std::string& text) {
    std::vector<double> numbers;
    for (std::size_t from = 0; from <= text.size();) {
        const std::size_t comma = std::min(text.find(',', from), text.size());
        const auto number = parse_number(text.substr(from, comma - from));
        if (!number || !std::isfinite(*number)) numbers.clear();
        if (!number || !std::isfinite(*number)) break;
        numbers.push_back(*number);
        from = comma + 1;
    }
    if (numbers.size() != 4 || numbers[0] > numbers[2] || numbers[1] > numbers[3])
        return Error{ErrorCode::usage, fmt::format("--box {} is not XMIN,YMIN,XMAX,YMAX in metres", text)};
    return ExportBox{numbers[0], numbers[1], numbers[2], numbers[3]};
}

// "513" or "1025x513".
Result<std::pair<int, int>> parse_sides(const std::string& text) {
    const auto sides = parse_size(text.find('x') == std::string::npos ? text + "x" + text : text);
    if (!sides) return Error{ErrorCode::usage, fmt::format("--size {} is not a number of samples, such as 1025", text)};
    return *sides;
}

}  // namespace

int run_export(int argc, char** argv) {
    CLI::App app{
        "Writes part of a store as a file of a common format: heights or imagery as GeoTIFF, or a texture tile as DDS.",
        "scree export"};
    RasterExport options;
    std::string path, heights, imagery, texture, out, box, size, json;
    int level = 0;
    app.add_option("STORE", path, "A .scree file")->required();
    auto* const what = app.add_option_group("What", "What to write");
    auto* const heights_option = what->add_option(
        "--heights", heights, "Heights as GeoTIFF of points: integers where all are whole metres, else floats");
    heights_option->type_name("FILE");
    auto* const imagery_option =
        what->add_option("--imagery", imagery, "Texels as GeoTIFF of areas, RGBA")->type_name("FILE");
    auto* const texture_option =
        what->add_option("--texture", texture, "Texture tile LEVEL/X/Y as DDS (DXT1 with its mips)");
    what->require_option(1);
    auto* const output_option = app.add_option("-o,--output", out, "The file to write a texture tile to")
                                    ->type_name("FILE")
                                    ->needs(texture_option);
    texture_option->needs(output_option);
    auto* const box_option =
        app.add_option("--box", box, "XMIN,YMIN,XMAX,YMAX in metres in the store's CRS; default: everything")
            ->excludes(texture_option);
    auto* const level_option =
        app.add_option("--level", level, "Level of the pyramid; default: the finest")->excludes(texture_option);
    auto* const size_option =
        app.add_option("--size", size,
                       "Heights only: SIDE samples, or COLUMNSxROWS, over the box, its edges included, of the finest "
                       "surface")
            ->excludes(texture_option)
            ->excludes(imagery_option)
            ->excludes(level_option);
    app.add_flag("--force", options.force, "Replace existing files");
    app.add_flag("--quiet", options.quiet, "No progress");
    add_json_option(app, json);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    Result<std::string> report = std::string();
    if (*texture_option) {
        report = export_texture(path, texture, out, options.force);
    } else {
        options.out = *heights_option ? heights : imagery;
        if (*level_option) options.level = level;
        if (*box_option) {
            const auto parsed = parse_box(box);
            if (!parsed) return report_error("scree export", parsed.error());
            options.box = *parsed;
        }
        if (*size_option) {
            const auto parsed = parse_sides(size);
            if (!parsed) return report_error("scree export", parsed.error());
            options.size = *parsed;
        }
        install_interrupt_handler();
        report = export_part(path, options, static_cast<bool>(*heights_option));
    }
    if (!report) return report_error("scree export", report.error());
    if (json.empty()) return 0;
    if (auto ok = write_text(json, *report); !ok) return report_error("scree export", ok.error());
    return 0;
}

}  // namespace scree
