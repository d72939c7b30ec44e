#include "tools/pyramid/build_state.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tools/source/sidecars.h"

namespace scree {
namespace {

using Json = nlohmann::ordered_json;

// Of what runs of one version write the same for the same pixels.
constexpr int kBuildVersion = 1;

std::string source_list(const Json& sources) {
    std::string names;
    for (const Json& source : sources) names += (names.empty() ? "" : ", ") + source.value("name", std::string());
    return names;
}

// Of sources of the same names.
std::string sidecars_that_differ(const Json& begun, const Json& now) {
    std::string said;
    for (std::size_t k = 0; k < std::min(begun.size(), now.size()); ++k) {
        const auto of = [&](const Json& sources) { return sources[k].value("sidecars", SidecarPrints()); };
        const std::string difference = sidecar_difference(of(begun), of(now));
        if (!difference.empty()) said += (said.empty() ? "" : ", ") + difference;
    }
    return said;
}

std::string text_of(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

std::optional<std::string> option_difference(const Json& begun, const Json& now) {
    std::set<std::string> names;
    for (const Json* options : {&begun, &now})
        for (const auto& [name, value] : options->items()) names.insert(name);
    for (const std::string& name : names) {
        if (begun.contains(name) && !now.contains(name))
            return fmt::format("--{} {}, which is not given now", name, text_of(begun.at(name)));
        if (!begun.contains(name)) return fmt::format("no --{}, which is {} now", name, text_of(now.at(name)));
        if (begun.at(name) != now.at(name))
            return fmt::format("--{} {}, which is {} now", name, text_of(begun.at(name)), text_of(now.at(name)));
    }
    return std::nullopt;
}

}  // namespace

std::string BuildState::text() const {
    Json json = {{"identity", identity},           {"heights_done", heights_done},
                 {"warp_rms_m", warp_rms_m},       {"filled_samples", filled_samples},
                 {"district_rows", district_rows}, {"deep_rows", deep_rows}};
    if (heights_done) {
        Dataset d = dataset;
        d.texture_tiles = 1;  // unknown; a dataset has some
        json["dataset"] = dataset_to_json(d);
    }
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<BuildState> BuildState::from_text(const std::string& text) {
    const Json json = Json::parse(text, nullptr, false);
    const Error bad{ErrorCode::store, "the state of the build is not what this program writes"};
    if (!json.is_object()) return bad;
    BuildState state;
    try {
        state.identity = json.at("identity").get<std::string>();
        state.heights_done = json.at("heights_done").get<bool>();
        state.warp_rms_m = json.at("warp_rms_m").get<double>();
        state.filled_samples = json.at("filled_samples").get<std::int64_t>();
        state.district_rows = json.at("district_rows").get<std::int64_t>();
        state.deep_rows = json.at("deep_rows").get<std::int64_t>();
        if (state.heights_done) {
            auto dataset = dataset_from_json(json.at("dataset").get<std::string>());
            if (!dataset) return dataset.error();
            state.dataset = std::move(*dataset);
        }
    } catch (const Json::exception&) {
        return bad;
    }
    if (state.district_rows < 0 || state.deep_rows < 0) return bad;
    return state;
}

std::string identity_of(const Dataset& dataset) {
    const Json all = Json::parse(dataset_to_json(dataset));
    // What only the finished store knows.
    static const std::set<std::string> made = {
        "height_tiles",     "texture_tiles",       "present_cells", "height_offset_m",
        "height_quantum_m", "min_height_m",        "max_height_m",  "height_quantum_error_m",
        "warp_error_m",     "coarsest_leaf_level", "geo_grid"};
    Json json = {{"build_version", kBuildVersion}};
    for (const auto& [name, value] : all.items())
        if (made.count(name) == 0) json[name] = value;
    if (!json.contains("options")) json["options"] = Json::object();
    return json.dump();
}

std::optional<std::string> identity_difference(const std::string& begun_text, const std::string& now_text) {
    if (begun_text == now_text) return std::nullopt;
    const Json begun = Json::parse(begun_text, nullptr, false), now = Json::parse(now_text, nullptr, false);
    if (!begun.is_object() || !begun.contains("sources") || !begun.contains("options") ||
        begun.value("build_version", 0) != kBuildVersion)
        return "another version of this program";
    const std::string sources_then = source_list(begun.at("sources")), sources_now = source_list(now.at("sources"));
    if (sources_then != sources_now) return fmt::format("the sources {}, which are {} now", sources_then, sources_now);
    if (auto sidecars = sidecars_that_differ(begun.at("sources"), now.at("sources")); !sidecars.empty())
        return fmt::format("other sidecars: since then {}", sidecars);
    if (begun.at("sources") != now.at("sources"))
        return fmt::format("sources of the same names ({}) and other content", sources_then);
    if (auto difference = option_difference(begun.at("options"), now.at("options"))) return difference;
    for (const auto& [name, value] : now.items())
        if (!begun.contains(name) || begun.at(name) != value)
            return fmt::format("{} {}, which is {} now", name,
                               begun.contains(name) ? text_of(begun.at(name)) : std::string("unknown"), text_of(value));
    return "something that differs";
}

}  // namespace scree
