#include "tools/pyramid/build_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <sstream>
#include <vector>

#include "tools/pyramid/codec_names.h"
#include "tools/source/number_text.h"

namespace scree {
namespace {

constexpr const char* kChosen = "auto ";  // before a stretch that no user typed

const std::map<std::string, Kernel> kKernels = {
    {"nearest", Kernel::nearest}, {"bilinear", Kernel::bilinear}, {"cubic", Kernel::cubic}};

std::string fill_text(const FillRule& rule) {
    switch (rule.kind) {
        case FillRule::Kind::none:
            return "none";
        case FillRule::Kind::smooth:
            return "smooth";
        case FillRule::Kind::value:
            break;
    }
    return fmt::format("{}", rule.value);
}

std::optional<std::vector<double>> parse_numbers(const std::string& text) {
    std::vector<double> numbers;
    for (std::size_t from = 0; from <= text.size();) {
        const std::size_t comma = std::min(text.find(',', from), text.size());
        const auto number = parse_number(text.substr(from, comma - from));
        if (!number) return std::nullopt;
        numbers.push_back(*number);
        from = comma + 1;
    }
    return numbers;
}

std::optional<int> parse_int(const std::string& text) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

using Text = std::optional<std::string>;

// An option both ways. It is as it is by default where there is no text.
struct RecordedOption {
    const char* name;  // on the command line
    std::function<Text(const BuildOptions& options)> text;
    std::function<bool(const std::string& text, BuildOptions& options)> set;  // false: it makes no sense
};

const BuildOptions& defaults() {
    static const BuildOptions all;
    return all;
}

Text text_of(const std::optional<double>& value) {
    if (!value) return std::nullopt;
    return fmt::format("{}", *value);
}

template <class T, class Base>
RecordedOption number(const char* name, T Base::*field) {
    return {name, [field](const BuildOptions& o) { return o.*field == defaults().*field ? Text{} : text_of(o.*field); },
            [field](const std::string& text, BuildOptions& o) {
                const auto v = parse_number(text);
                if (v) o.*field = *v;
                return v.has_value();
            }};
}
RecordedOption size(const char* name, int BuildOptions::*field) {
    return {
        name,
        [field](const BuildOptions& o) { return o.*field == defaults().*field ? Text{} : fmt::format("{}", o.*field); },
        [field](const std::string& text, BuildOptions& o) {
            const auto v = parse_int(text);
            if (v) o.*field = *v;
            return v.has_value();
        }};
}
template <class Base>
RecordedOption words(const char* name, std::optional<std::string> Base::*field) {
    return {name, [field](const BuildOptions& o) { return o.*field; },
            [field](const std::string& text, BuildOptions& o) {
                o.*field = text;
                return true;
            }};
}
template <class T>
RecordedOption choice(const char* name, T BuildOptions::*field, std::map<std::string, T> choices) {
    return {name,
            [field, choices](const BuildOptions& o) {
                for (const auto& [text, value] : choices)
                    if (value == o.*field && value != defaults().*field) return Text{text};
                return Text{};
            },
            [field, choices](const std::string& text, BuildOptions& o) {
                const auto found = choices.find(text);
                if (found != choices.end()) o.*field = found->second;
                return found != choices.end();
            }};
}

Text stretch_text(const BuildOptions& o) {
    const auto& stretch = o.colours.stretch;
    if (!stretch) return std::nullopt;
    return fmt::format("{}{},{}", stretch->spares_8bit ? kChosen : "", stretch->low, stretch->high);
}

bool set_stretch(const std::string& text, BuildOptions& o) {
    const bool chosen = text.rfind(kChosen, 0) == 0;
    const auto v = parse_numbers(chosen ? text.substr(std::string(kChosen).size()) : text);
    if (!v || v->size() != 2) return false;
    o.colours.stretch = Stretch{(*v)[0], (*v)[1], chosen};
    return true;
}

Text bands_text(const BuildOptions& o) {
    if (o.colours.bands.empty()) return std::nullopt;
    return fmt::format("{}", fmt::join(o.colours.bands, ","));
}

bool set_bands(const std::string& text, BuildOptions& o) {
    const auto v = parse_numbers(text);
    if (!v) return false;
    for (const double band : *v) {
        if (!(band >= 1 && band <= 65536)) return false;
        o.colours.bands.push_back(static_cast<int>(band));
    }
    return true;
}

// The only place that lists them.
const std::vector<RecordedOption>& recorded() {
    static const std::vector<RecordedOption> all = {
        words("crs", &BuildOptions::crs),
        words("assume-crs", &BuildOptions::assume_crs),
        {"assume-same-datum", [](const BuildOptions& o) { return o.assume_same_datum ? Text{"yes"} : Text{}; },
         [](const std::string& text, BuildOptions& o) { return o.assume_same_datum = text == "yes"; }},
        choice<Kernel>("resampling", &BuildOptions::kernel, kKernels),
        {"fill",
         [](const BuildOptions& o) {
             return fill_text(o.fill) == fill_text(defaults().fill) ? Text{} : fill_text(o.fill);
         },
         [](const std::string& text, BuildOptions& o) {
             const auto rule = parse_fill(text);
             if (rule) o.fill = *rule;
             return rule.ok();
         }},
        number<std::optional<double>>("spacing", &BuildOptions::spacing_m),
        number<std::optional<double>>("height-scale", &BuildOptions::height_scale),
        number<double>("height-offset", &BuildOptions::height_offset_m),
        words("vertical-crs", &BuildOptions::vertical_crs),
        {"source-vertical-crs",
         [](const BuildOptions& o) {
             return o.source_vertical_crs.empty() ? Text{} : fmt::format("{}", fmt::join(o.source_vertical_crs, "\n"));
         },
         [](const std::string& text, BuildOptions& o) {
             std::istringstream lines(text);
             for (std::string line; std::getline(lines, line);) o.source_vertical_crs.push_back(line);
             return true;
         }},
        choice<HeightEncoding>("height-encoding", &BuildOptions::height_encoding,
                               {{"terrarium", HeightEncoding::terrarium}, {"mapbox", HeightEncoding::mapbox}}),
        number<std::optional<double>>("nodata", &BuildOptions::nodata),
        number<std::optional<double>>("height-quantum", &BuildOptions::height_quantum_m),
        choice<HeightCodec>("height-codec", &BuildOptions::height_codec, codecs_by_name(height_codecs())),
        {"bands", bands_text, set_bands},
        {"stretch", stretch_text, set_stretch},
        {"imagery-nodata", [](const BuildOptions& o) { return text_of(o.colours.nodata); },
         [](const std::string& text, BuildOptions& o) {
             o.colours.nodata = parse_number(text);
             return o.colours.nodata.has_value();
         }},
        choice<TextureCodec>("texture-codec", &BuildOptions::texture_codec, codecs_by_name(texture_codecs())),
        choice<TextureQuality>("texture-quality", &BuildOptions::texture_quality, {{"high", TextureQuality::high}}),
        size("tile-size", &BuildOptions::tile_size),
        size("texture-size", &BuildOptions::texture_size),
    };
    return all;
}

}  // namespace

Result<FillRule> parse_fill(const std::string& text) {
    if (text == "smooth") return FillRule{FillRule::Kind::smooth};
    if (text == "none") return FillRule{FillRule::Kind::none};
    const auto height = parse_number(text);
    if (!height || !(std::abs(*height) <= 1e7))
        return Error{ErrorCode::usage, fmt::format("--fill {} is not smooth, none or a height within 1e7 m", text)};
    return FillRule{FillRule::Kind::value, *height};
}

std::map<std::string, std::string> options_record(const BuildOptions& o, const std::optional<Stretch>& stretch) {
    BuildOptions built = o;
    built.colours.stretch = stretch;
    std::map<std::string, std::string> record;
    for (const RecordedOption& option : recorded())
        if (const Text text = option.text(built)) record[option.name] = *text;
    return record;
}

std::vector<std::string> recorded_options() {
    std::vector<std::string> names;
    for (const RecordedOption& option : recorded()) names.emplace_back(option.name);
    return names;
}

Result<void> apply_record(const std::map<std::string, std::string>& record, BuildOptions& options) {
    for (const auto& [name, value] : record) {
        const auto option = std::find_if(recorded().begin(), recorded().end(),
                                         [&, n = name](const RecordedOption& r) { return r.name == n; });
        if (option == recorded().end() || !option->set(value, options))
            return Error{ErrorCode::store, fmt::format("the store was built with --{} {}, which this program does not "
                                                       "know: it cannot be updated by it",
                                                       name, value)};
    }
    return {};
}

}  // namespace scree
