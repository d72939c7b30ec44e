#include "runtime/lod/lod_method.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>

namespace scree {
namespace {

template <class T>
struct Word {
    T value;
    std::string_view text;
};

constexpr std::array<Word<LodMethod>, 3> kMethods{
    {{LodMethod::geomip, "geomip"}, {LodMethod::rsg, "rsg"}, {LodMethod::block_rsg, "block-rsg"}}};
constexpr std::array<Word<ErrorMetric>, 3> kMetrics{
    {{ErrorMetric::guaranteed, "guaranteed"}, {ErrorMetric::uc, "uc"}, {ErrorMetric::deboer, "deboer"}}};
constexpr std::array<Word<ReuseTest>, 3> kReuses{
    {{ReuseTest::off, "off"}, {ReuseTest::paper, "paper"}, {ReuseTest::exact, "exact"}}};
constexpr std::array<Word<Culling>, 2> kCullings{{{Culling::box, "box"}, {Culling::corners, "corners"}}};
constexpr std::array<Word<CrackFix>, 2> kCracks{{{CrackFix::stitch, "stitch"}, {CrackFix::dike, "dike"}}};

template <class T, std::size_t N>
std::string_view text_of(const std::array<Word<T>, N>& words, T value) {
    for (const Word<T>& word : words)
        if (word.value == value) return word.text;
    return "?";
}

template <class T, std::size_t N>
Result<T> value_of(const std::array<Word<T>, N>& words, std::string_view option, const std::string& text) {
    std::string known;
    for (const Word<T>& word : words) {
        if (word.text == text) return word.value;
        known += fmt::format("{}{}", known.empty() ? "" : ", ", word.text);
    }
    return Error{ErrorCode::usage, fmt::format("{} {} is none of {}", option, text, known)};
}

Error clash(const std::string& what, const std::string& why) {
    return {ErrorCode::usage, fmt::format("{}: {}", what, why)};
}

Result<void> expect_metric_of_method(const LodSettings& s) {
    if (s.metric == ErrorMetric::deboer && s.method != LodMethod::geomip)
        return clash(fmt::format("--metric deboer with --lod {}", to_string(s.method)),
                     "de Boer's metric judges whole tiles, so it goes with --lod geomip only");
    if (s.metric == ErrorMetric::uc && s.method != LodMethod::rsg)
        return clash(fmt::format("--metric uc with --lod {}", to_string(s.method)),
                     "Ueng & Chuang's metric judges single vertices, so it goes with --lod rsg only");
    return {};
}

Result<void> expect_cache_of_method(const LodSettings& s) {
    if (s.reuse != ReuseTest::off && s.method != LodMethod::rsg)
        return clash(fmt::format("--cache {} with --lod {}", to_string(s.reuse), to_string(s.method)),
                     "only --lod rsg keeps meshes by the eye that they were chosen for");
    if (!(std::isfinite(s.s_px) && s.s_px >= 0))
        return clash(fmt::format("--s {}", s.s_px), "is not a length in pixels");
    if (s.s_px > 0 && s.reuse == ReuseTest::off)
        return clash(fmt::format("--s {}", s.s_px), "the allowance of reuse needs --cache paper or --cache exact");
    return {};
}

}  // namespace

std::string_view to_string(LodMethod method) { return text_of(kMethods, method); }
std::string_view to_string(ErrorMetric metric) { return text_of(kMetrics, metric); }
std::string_view to_string(ReuseTest reuse) { return text_of(kReuses, reuse); }
std::string_view to_string(Culling culling) { return text_of(kCullings, culling); }
std::string_view to_string(CrackFix cracks) { return text_of(kCracks, cracks); }

Result<LodSettings> lod_settings_from(const LodOptions& o) {
    const auto method = value_of(kMethods, "--lod", o.lod);
    if (!method) return method.error();
    const auto metric = value_of(kMetrics, "--metric", o.metric);
    if (!metric) return metric.error();
    const auto reuse = value_of(kReuses, "--cache", o.cache);
    if (!reuse) return reuse.error();
    const auto culling = value_of(kCullings, "--cull", o.cull);
    if (!culling) return culling.error();
    const auto cracks = value_of(kCracks, "--cracks", o.cracks);
    if (!cracks) return cracks.error();
    const LodSettings s{*method, *metric, *reuse, o.s_px, *culling, *cracks};
    if (auto ok = expect_metric_of_method(s); !ok) return ok.error();
    if (auto ok = expect_cache_of_method(s); !ok) return ok.error();
    if (s.cracks == CrackFix::dike && s.method != LodMethod::rsg)
        return clash(fmt::format("--cracks dike with --lod {}", to_string(s.method)),
                     "dikes join the blocks of --lod rsg only");
    return s;
}

std::string command_line_of(const LodSettings& s) {
    const LodSettings d;
    std::string line = fmt::format("--lod {}", to_string(s.method));
    if (s.metric != d.metric) line += fmt::format(" --metric {}", to_string(s.metric));
    if (s.reuse != d.reuse) line += fmt::format(" --cache {}", to_string(s.reuse));
    if (s.s_px != d.s_px) line += fmt::format(" --s {}", s.s_px);
    if (s.culling != d.culling) line += fmt::format(" --cull {}", to_string(s.culling));
    if (s.cracks != d.cracks) line += fmt::format(" --cracks {}", to_string(s.cracks));
    return line;
}

// A method that can be drawn has its line here.
bool is_built_in(const LodSettings& s) {
    return s.method != LodMethod::geomip || s.metric != ErrorMetric::uc;
}

Result<void> expect_built_in(const LodSettings& s) {
    if (is_built_in(s)) return {};
    return Error{ErrorCode::usage, fmt::format("{} is not built in", command_line_of(s))};
}

}  // namespace scree
