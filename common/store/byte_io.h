// Little-endian, field by field, bounds-checked: the only way bytes of the format are written or read.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace scree {

class ByteWriter {
public:
    explicit ByteWriter(std::vector<std::uint8_t>& out) : out_(out) {}

    void u8(std::uint8_t v) { out_.push_back(v); }
    void u32(std::uint32_t v) {
        for (int k = 0; k < 4; ++k) out_.push_back(static_cast<std::uint8_t>(v >> (8 * k)));
    }
    void u64(std::uint64_t v) {
        u32(static_cast<std::uint32_t>(v));
        u32(static_cast<std::uint32_t>(v >> 32));
    }
    void i32(std::int32_t v) { u32(static_cast<std::uint32_t>(v)); }
    void f32(float v) { u32(std::bit_cast<std::uint32_t>(v)); }
    void f64(double v) { u64(std::bit_cast<std::uint64_t>(v)); }
    void bytes(std::span<const std::uint8_t> v) { out_.insert(out_.end(), v.begin(), v.end()); }

private:
    std::vector<std::uint8_t>& out_;
};

/// Reads past the end give zeros and clear ok(): check ok() once after a group of fields.
class ByteReader {
public:
    explicit ByteReader(std::span<const std::uint8_t> in) : in_(in) {}

    bool ok() const { return ok_; }
    std::size_t remaining() const { return in_.size() - position_; }

    std::uint8_t u8() { return take(1) ? in_[position_ - 1] : std::uint8_t{0}; }
    std::uint32_t u32() {
        if (!take(4)) return 0;
        const std::uint8_t* p = in_.data() + position_ - 4;
        return std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 | std::uint32_t{p[3]} << 24;
    }
    std::uint64_t u64() {
        const std::uint64_t low = u32();
        return low | std::uint64_t{u32()} << 32;
    }
    std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
    float f32() { return std::bit_cast<float>(u32()); }
    double f64() { return std::bit_cast<double>(u64()); }
    std::span<const std::uint8_t> bytes(std::size_t count) {
        return take(count) ? in_.subspan(position_ - count, count) : std::span<const std::uint8_t>{};
    }

private:
    bool take(std::size_t count) {
        if (!ok_ || remaining() < count) {
            ok_ = false;
            return false;
        }
        position_ += count;
        return true;
    }

    std::span<const std::uint8_t> in_;
    std::size_t position_ = 0;
    bool ok_ = true;
};

}  // namespace scree
