// The type that decoded samples have in memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tools/source/image_source.h"

namespace scree {

/// Calls visit with a value of that type; half is widened to float.
template <class Visit>
void with_memory_type(SampleType type, Visit&& visit) {
    switch (type) {
        case SampleType::u8:
            return visit(std::uint8_t{});
        case SampleType::i8:
            return visit(std::int8_t{});
        case SampleType::u16:
            return visit(std::uint16_t{});
        case SampleType::i16:
            return visit(std::int16_t{});
        case SampleType::u32:
            return visit(std::uint32_t{});
        case SampleType::i32:
            return visit(std::int32_t{});
        case SampleType::u64:
            return visit(std::uint64_t{});
        case SampleType::i64:
            return visit(std::int64_t{});
        case SampleType::f16:
        case SampleType::f32:
            return visit(float{});
        case SampleType::f64:
            return visit(double{});
    }
}

}  // namespace scree
