// The tables of codecs (common/store/*_codec.h) as options know them.
#pragma once

#include <map>
#include <span>
#include <string>

namespace scree {

template <class Named>
auto codecs_by_name(std::span<const Named> all) {
    std::map<std::string, decltype(Named::codec)> choices;
    for (const Named& named : all) choices[named.name] = named.codec;
    return choices;
}

/// "raw|plane", by number.
template <class Named>
std::string codec_names(std::span<const Named> all) {
    std::string names;
    for (const Named& named : all) names += (names.empty() ? "" : "|") + std::string(named.name);
    return names;
}

}  // namespace scree
