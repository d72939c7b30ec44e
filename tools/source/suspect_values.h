// SuspectValues: counts samples that look like voids nobody declared. Files lose their nodata tag easily, and -32767
// taken for metres makes a pit that every certified error and every view then pays for. Suspects are the usual markers
// (-9999, -32768, -32767, 65535, 1.70141e38) and the extremes of sample types wider than 8 bits. A suspect is accused
// only when no other sample comes within 100 raw units of it: real low ground or a saturated sensor has neighbours. Not
// thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/source/height_source.h"
#include "tools/source/image_source.h"

namespace scree {

class SuspectValues {
public:
    SuspectValues(const ImageInfo& dem, const HeightReading& reading);

    /// Raw values as the file has them, before VoidRule; any number of rows in any order.
    void add(std::span<const double> values);
    void add(std::span<const float> values);

    /// One sentence for the user, or none when nothing is accused. Of several accused values: the one that most samples
    /// have, the first of equals in the order of values.
    std::optional<std::string> warning(const std::string& path) const;

private:
    struct Suspect {
        double value;
        std::int64_t samples = 0;
        bool has_neighbours = false;
    };
    bool is_declared(double v) const;
    void look_at(double v);
    template <class T>
    void add_all(std::span<const T> values);

    std::optional<double> tag_, user_;
    std::vector<Suspect> suspects_;           ///< ascending
    double ordinary_above_, ordinary_below_;  ///< between them no sample matters
};

}  // namespace scree
