#include "tools/pyramid/build_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <vector>

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

// Each sets its option from the text; false: it makes no sense.
using Setter = std::function<bool(const std::string& text, BuildOptions& options)>;

template <class T, class Base>
Setter number(T Base::*field) {
    return [field](const std::string& text, BuildOptions& o) {
        const auto v = parse_number(text);
        if (v) o.*field = *v;
        return v.has_value();
    };
}
Setter size(int BuildOptions::*field) {
    return [field](const std::string& text, BuildOptions& o) {
        const auto v = parse_int(text);
        if (v) o.*field = *v;
        return v.has_value();
    };
}
template <class Base>
Setter words(std::optional<std::string> Base::*field) {
    return [field](const std::string& text, BuildOptions& o) {
        o.*field = text;
        return true;
    };
}

bool set_stretch(const std::string& text, BuildOptions& o) {
    const bool chosen = text.rfind(kChosen, 0) == 0;
    const auto v = parse_numbers(chosen ? text.substr(std::string(kChosen).size()) : text);
    if (!v || v->size() != 2) return false;
    o.colours.stretch = Stretch{(*v)[0], (*v)[1], chosen};
    return true;
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

const std::map<std::string, Setter>& setters() {
    static const std::map<std::string, Setter> all = {
        {"crs", words(&BuildOptions::crs)},
        {"assume-crs", words(&BuildOptions::assume_crs)},
        {"assume-same-datum",
         [](const std::string& text, BuildOptions& o) { return o.assume_same_datum = text == "yes"; }},
        {"resampling",
         [](const std::string& text, BuildOptions& o) {
             const auto kernel = kKernels.find(text);
             if (kernel != kKernels.end()) o.kernel = kernel->second;
             return kernel != kKernels.end();
         }},
        {"fill",
         [](const std::string& text, BuildOptions& o) {
             const auto rule = parse_fill(text);
             if (rule) o.fill = *rule;
             return rule.ok();
         }},
        {"spacing", number<std::optional<double>>(&BuildOptions::spacing_m)},
        {"height-scale", number<std::optional<double>>(&BuildOptions::height_scale)},
        {"height-offset", number<double>(&BuildOptions::height_offset_m)},
        {"vertical-crs", words(&BuildOptions::vertical_crs)},
        {"nodata", number<std::optional<double>>(&BuildOptions::nodata)},
        {"height-quantum", number<std::optional<double>>(&BuildOptions::height_quantum_m)},
        {"bands", set_bands},
        {"stretch", set_stretch},
        {"imagery-nodata",
         [](const std::string& text, BuildOptions& o) {
             o.colours.nodata = parse_number(text);
             return o.colours.nodata.has_value();
         }},
        {"texture-quality",
         [](const std::string& text, BuildOptions& o) {
             if (text != "high") return false;
             o.texture_quality = TextureQuality::high;
             return true;
         }},
        {"tile-size", size(&BuildOptions::tile_size)},
        {"texture-size", size(&BuildOptions::texture_size)},
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
    std::map<std::string, std::string> record;
    const BuildOptions plain;
    const auto text = [&](const char* name, const std::optional<std::string>& value) {
        if (value) record[name] = *value;
    };
    const auto number = [&](const char* name, const std::optional<double>& value) {
        if (value) record[name] = fmt::format("{}", *value);
    };
    text("crs", o.crs);
    text("assume-crs", o.assume_crs);
    text("vertical-crs", o.vertical_crs);
    if (o.assume_same_datum) record["assume-same-datum"] = "yes";
    for (const auto& [name, kernel] : kKernels)
        if (kernel == o.kernel && kernel != plain.kernel) record["resampling"] = name;
    if (fill_text(o.fill) != fill_text(plain.fill)) record["fill"] = fill_text(o.fill);
    number("spacing", o.spacing_m);
    number("height-scale", o.height_scale);
    if (o.height_offset_m != 0) number("height-offset", o.height_offset_m);
    number("nodata", o.nodata);
    number("height-quantum", o.height_quantum_m);
    if (!o.colours.bands.empty()) record["bands"] = fmt::format("{}", fmt::join(o.colours.bands, ","));
    if (stretch)
        record["stretch"] = fmt::format("{}{},{}", stretch->spares_8bit ? kChosen : "", stretch->low, stretch->high);
    number("imagery-nodata", o.colours.nodata);
    if (o.texture_quality == TextureQuality::high) record["texture-quality"] = "high";
    if (o.tile_size != plain.tile_size) record["tile-size"] = fmt::format("{}", o.tile_size);
    if (o.texture_size != plain.texture_size) record["texture-size"] = fmt::format("{}", o.texture_size);
    return record;
}

Result<void> apply_record(const std::map<std::string, std::string>& record, BuildOptions& options) {
    for (const auto& [name, value] : record) {
        const auto setter = setters().find(name);
        if (setter == setters().end() || !setter->second(value, options))
            return Error{ErrorCode::store, fmt::format("the store was built with --{} {}, which this program does not "
                                                       "know: it cannot be updated by it",
                                                       name, value)};
    }
    return {};
}

}  // namespace scree
