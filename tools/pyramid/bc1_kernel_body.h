// The vector kernel of the BC1 encoder. Included inside the anonymous namespace of bc1_kernel_<instruction set>.cpp,
// which defines the vector types and operations that it is written in: no #pragma once, no includes.
//
// Layout: a 32-bit lane stands for a block, its two 16-bit halves for two texels of that block, texel i in the low half
// and texel i + 8 in the high one, i = 0..7. Work on texels runs in 16-bit halves, a sum over the texels of a block is
// one multiply-add of pairs into its 32-bit lane, and what is decided once a block (axis, least squares) runs in 32-bit
// floats in the very same lanes. No lane looks at another one, so the number of lanes does not change the result;
// floats use + - * / sqrt min max and truncation alone, in one fixed order.
//
// The colours of a block are mid + v * half, v = 2w - kSteps for the weights w = 0..kSteps: kSteps = 3 for opaque
// blocks (four colours), 2 for blocks with transparent texels (three colours; transparent texels have weight 0 and
// colour 0 and are not counted).
//
// Ideas from: S. Brown, squish (principal axis; least squares for given selectors); F. Giesen, stb_dxt (selectors from
// the projection on the endpoint axis; refinement rounds); R. Geldreich, rgbcx and I. Castano, icbc (endpoints rounded
// with regard to the error, not each for itself).

/// Texel values are stored times 32: then 16 products of two still fit 31 bits.
constexpr int kTexelShift = 5;
constexpr float kTexelScale = 32.0F;
constexpr int kPairs = 8;

/// Units of a projection that make one step of weight.
constexpr int kUnitShift = 5;
constexpr float kUnit = 1 << kUnitShift;

/// By how many levels a decoder shows the interpolated colours below their exact value, in the mean: 1/3 (1/4 of the
/// middle of three) if it rounds down, 0 if it rounds to nearest; GPUs do either (F. Giesen notes which in stb_dxt).
/// Half way is within 0.01 dB of the best for both; 0 would cost 0.2 dB on smooth images in a decoder that rounds down.
constexpr float kInterpolationLoss = 1.0F / 6.0F;

/// Least-squares fits, each rounded to 5, 6 and 5 bits. A second one gains 0.10 dB (0.28 on snow) and costs a third of
/// the time; a third one would gain 0.03 dB.
constexpr int kFits = 2;

/// How the first guess cuts the range along the axis.
struct Cut {
    float centre;    // of the limits, as a share of the range from its middle
    float distance;  // between limits, as a share of the range
    float shortest;  // ranges below are taken as this one
};

/// The limits lie less than a third of the range apart, for most texels lie between the extremes.
constexpr float kLimitDistance = 0.28F;

/// Shorter ranges are taken as this one, 44 levels along one channel or 15 along grey. Smooth blocks so start with the
/// middle weights, which leaves the endpoints free to lie apart as far as 5 and 6 bits have them. Measured on snow:
/// half of it -0.25 dB.
constexpr float kShortestRange = 700.0F;

constexpr Cut kCutInFour = {0.0F, kLimitDistance, kShortestRange};
constexpr Cut kCutInThree = {0.0F, 1.5F * kLimitDistance, kShortestRange};

/// Groups that go through a stage together. 2 to 8 run alike, 1 is a fifth slower; 4 of the widest take 14 KB of stack.
constexpr size_t kBatchGroups = 4;

struct Texels {
    Ints channel[3][kPairs];
};

/// Sums over the texels of a block, times 32.
struct Sums {
    Floats channel[3];
};

struct Axis {
    Ints channel[3];  // both halves alike
};

struct Weights {
    Ints pair[kPairs];
};

/// What least squares needs to know of the weights: sums of w, w*w and w*texel (times 32) over the block.
struct Moments {
    Floats w;
    Floats ww;
    Floats wx[3];
};

/// In levels.
struct Line {
    Floats mid[3];
    Floats half[3];
};

struct Endpoints {
    Ints high[3];  // 5, 6, 5 bits
    Ints low[3];
    Line line;  // as decoded
};

inline Ints low_half_signed(Ints a) { return shift_right_signed32<16>(shift_left32<16>(a)); }
inline Ints both_halves(Ints a) { return shift_left32<16>(a) | (a & splat(0xFFFF)); }

/// Returns the lanes whose block has a transparent texel.
inline Mask load_texels(const uint8_t* rgba, size_t row_bytes, Texels& texels) {
    const Ints low_mask = splat(0xFF << kTexelShift);
    const Ints high_mask = splat(0xFF << (16 + kTexelShift));
    Ints all_opaque = splat(-1);
    for (int y = 0; y < 2; ++y) {
        Ints upper[4];
        Ints lower[4];
        load_row(rgba + static_cast<size_t>(y) * row_bytes, upper);
        load_row(rgba + static_cast<size_t>(y + 2) * row_bytes, lower);
        for (int x = 0; x < 4; ++x) {
            const Ints a = upper[x];
            const Ints b = lower[x];
            const int i = 4 * y + x;
            all_opaque = all_opaque & a & b;
            texels.channel[0][i] =
                (shift_left32<kTexelShift>(a) & low_mask) | (shift_left32<16 + kTexelShift>(b) & high_mask);
            texels.channel[1][i] =
                (shift_right32<8 - kTexelShift>(a) & low_mask) | (shift_left32<8 + kTexelShift>(b) & high_mask);
            texels.channel[2][i] =
                (shift_right32<16 - kTexelShift>(a) & low_mask) | (shift_left32<kTexelShift>(b) & high_mask);
        }
    }
    return less32(splat(-1), all_opaque);  // alpha is the top byte: its top bit set in all texels means all opaque
}

inline Sums sum_texels(const Texels& texels) {
    Sums sums;
    for (int c = 0; c < 3; ++c) {
        Ints sum = texels.channel[c][0];
        for (int i = 1; i < kPairs; ++i) {
            sum = add16(sum, texels.channel[c][i]);  // 8 * 255 * 32 < 2^16
        }
        sums.channel[c] = to_floats(add32(sum & splat(0xFFFF), shift_right32<16>(sum)));
    }
    return sums;
}

struct Symmetric {
    Floats rr, rg, rb, gg, gb, bb;
};

inline Symmetric squared(const Symmetric& m) {
    return {m.rr * m.rr + m.rg * m.rg + m.rb * m.rb, m.rr * m.rg + m.rg * m.gg + m.rb * m.gb,
            m.rr * m.rb + m.rg * m.gb + m.rb * m.bb, m.rg * m.rg + m.gg * m.gg + m.gb * m.gb,
            m.rg * m.rb + m.gg * m.gb + m.gb * m.bb, m.rb * m.rb + m.gb * m.gb + m.bb * m.bb};
}

/// n * 32^2 times the scatter matrix; exact, every term being a 24-bit integer times 2^10.
inline Symmetric scatter(const Texels& texels, const Sums& sums, Floats n) {
    Ints rr = zero();
    Ints rg = zero();
    Ints rb = zero();
    Ints gg = zero();
    Ints gb = zero();
    Ints bb = zero();
    for (int i = 0; i < kPairs; ++i) {
        const Ints r = texels.channel[0][i];
        const Ints g = texels.channel[1][i];
        const Ints b = texels.channel[2][i];
        rr = add_products(rr, r, r);
        rg = add_products(rg, r, g);
        rb = add_products(rb, r, b);
        gg = add_products(gg, g, g);
        gb = add_products(gb, g, b);
        bb = add_products(bb, b, b);
    }
    const Floats r = sums.channel[0];
    const Floats g = sums.channel[1];
    const Floats b = sums.channel[2];
    return {n * to_floats(rr) - r * r, n * to_floats(rg) - r * g, n * to_floats(rb) - r * b,
            n * to_floats(gg) - g * g, n * to_floats(gb) - g * b, n * to_floats(bb) - b * b};
}

/// The eigenvector of the greatest eigenvalue, its largest component 16383: a column of the fourth power of the scatter
/// matrix. `solid` receives the lanes whose block has one colour.
inline Axis principal_axis(const Texels& texels, const Sums& sums, Floats n, unsigned& solid) {
    const Symmetric s = scatter(texels, sums, n);
    const Floats trace = s.rr + s.gg + s.bb;
    solid = lane_bits(less(trace, splat(1.0F)));
    const Floats scale = splat(1.0F) / maximum(trace, splat(1.0F));
    // The greatest eigenvalue is 1/3..1 of the trace: no underflow.
    const Symmetric m = squared({s.rr * scale, s.rg * scale, s.rb * scale, s.gg * scale, s.gb * scale, s.bb * scale});
    Floats column[3] = {m.rr, m.rg, m.rb};
    const Mask green_longer = less(m.rr, m.gg);
    column[0] = select(green_longer, m.rg, column[0]);
    column[1] = select(green_longer, m.gg, column[1]);
    column[2] = select(green_longer, m.gb, column[2]);
    const Mask blue_longer = less(maximum(m.rr, m.gg), m.bb);
    column[0] = select(blue_longer, m.rb, column[0]);
    column[1] = select(blue_longer, m.gb, column[1]);
    column[2] = select(blue_longer, m.bb, column[2]);
    const Floats direction[3] = {m.rr * column[0] + m.rg * column[1] + m.rb * column[2],
                                 m.rg * column[0] + m.gg * column[1] + m.gb * column[2],
                                 m.rb * column[0] + m.gb * column[1] + m.bb * column[2]};
    const Floats longest = maximum(maximum(magnitude(direction[0]), magnitude(direction[1])), magnitude(direction[2]));
    const Floats unit = splat(16383.0F) / maximum(longest, splat(1e-20F));
    Axis axis;
    for (int c = 0; c < 3; ++c) {
        axis.channel[c] = both_halves(truncate(direction[c] * unit));
    }
    return axis;
}

/// Steps of 1 << kUnitShift units to weights.
template <int kSteps>
inline Ints weight_of(Ints units) {
    return min16(max16(shift_right_signed16<kUnitShift>(units), zero()), splat(kSteps * 0x10001));
}

/// The first guess: limits around the middle of the range along the axis. Transparent texels, where there are any, do
/// not count.
template <int kSteps>
inline Weights first_weights(const Texels& texels, const Axis& axis, const Cut& cut, const Ints* opaque) {
    Ints along[kPairs];
    Ints smallest = splat(0x7FFF7FFF);
    Ints largest = splat(static_cast<int>(0x80008000U));
    for (int i = 0; i < kPairs; ++i) {
        along[i] = add16(add16(mul_round16(texels.channel[0][i], axis.channel[0]),
                               mul_round16(texels.channel[1][i], axis.channel[1])),
                         mul_round16(texels.channel[2][i], axis.channel[2]));
        if constexpr (kSteps == 2) {
            const Ints transparent = opaque[i] ^ splat(-1);
            smallest = min16(smallest, along[i] | (transparent & splat(0x7FFF7FFF)));
            largest = max16(largest, (along[i] & opaque[i]) | (transparent & splat(static_cast<int>(0x80008000U))));
        } else {
            smallest = min16(smallest, along[i]);
            largest = max16(largest, along[i]);
        }
    }
    const Floats low = to_floats(low_half_signed(min16(smallest, shift_right_signed32<16>(smallest))));
    const Floats high = to_floats(low_half_signed(max16(largest, shift_right_signed32<16>(largest))));
    const Floats gain = splat(kUnit * 32768.0F / cut.distance) / maximum(high - low, splat(cut.shortest));
    const Floats middle = splat(0.5F + cut.centre) * high + splat(0.5F - cut.centre) * low;
    const Ints start =
        both_halves(truncate(splat(kUnit * 0.5F * (kSteps + 1)) - middle * gain * splat(1.0F / 32768.0F)));
    const Ints gains = both_halves(truncate(gain));
    Weights weights;
    for (int i = 0; i < kPairs; ++i) {
        weights.pair[i] = weight_of<kSteps>(add16(start, mul_round16(along[i], gains)));
        if constexpr (kSteps == 2) {
            weights.pair[i] = weights.pair[i] & opaque[i];
        }
    }
    return weights;
}

/// Every texel to the nearest colour of the line.
template <int kSteps>
inline Weights weights_for(const Texels& texels, const Line& line, const Ints* opaque) {
    const Floats length_squared =
        line.half[0] * line.half[0] + line.half[1] * line.half[1] + line.half[2] * line.half[2];
    // 16384 half / |half|^2 makes a step of 2 half one unit of the projection. The shortest line between two codes,
    // four levels of green, keeps it within 16 bits.
    const Floats scale = splat(16384.0F) / maximum(length_squared, splat(0.4F));
    Ints axis[3];
    Floats at_mid = splat(0.0F);
    for (int c = 0; c < 3; ++c) {
        const Floats component = line.half[c] * scale;
        at_mid = at_mid + component * (line.mid[c] - splat(kInterpolationLoss * 2.0F / 3.0F));
        axis[c] = both_halves(truncate(component));
    }
    const Ints start =
        both_halves(truncate(splat(kUnit * 0.5F * (kSteps + 1)) - at_mid * splat(kTexelScale / 32768.0F)));
    Weights weights;
    for (int i = 0; i < kPairs; ++i) {
        const Ints along =
            add16(add16(start, mul_round16(texels.channel[0][i], axis[0])),
                  add16(mul_round16(texels.channel[1][i], axis[1]), mul_round16(texels.channel[2][i], axis[2])));
        weights.pair[i] = weight_of<kSteps>(along);
        if constexpr (kSteps == 2) {
            weights.pair[i] = weights.pair[i] & opaque[i];
        }
    }
    return weights;
}

inline Moments moments_of(const Texels& texels, const Weights& weights) {
    Ints w_sum = zero();
    Ints ww_sum = zero();
    Ints wx_sum[3] = {zero(), zero(), zero()};
    for (int i = 0; i < kPairs; ++i) {
        const Ints w = weights.pair[i];
        w_sum = add16(w_sum, w);
        ww_sum = add_products(ww_sum, w, w);
        for (int c = 0; c < 3; ++c) {
            wx_sum[c] = add_products(wx_sum[c], w, texels.channel[c][i]);
        }
    }
    return {to_floats(mul_add_pairs(w_sum, splat(0x00010001))),
            to_floats(ww_sum),
            {to_floats(wx_sum[0]), to_floats(wx_sum[1]), to_floats(wx_sum[2])}};
}

/// The sum over the interpolated texels of one.
template <int kSteps>
inline Floats interpolated_count(const Moments& moments) {
    const Floats products = splat(static_cast<float>(kSteps)) * moments.w - moments.ww;  // of w (kSteps - w)
    return kSteps == 3 ? products * splat(0.5F) : products;
}

/// The line of least squared error for these weights. All weights equal: the mean, of no length.
template <int kSteps>
inline Line fit_line(const Sums& sums, const Moments& moments, Floats n) {
    constexpr auto kK = static_cast<float>(kSteps);
    const Floats v = splat(2.0F) * moments.w - splat(kK) * n;
    const Floats vv = splat(4.0F) * moments.ww - splat(4.0F * kK) * moments.w + splat(kK * kK) * n;
    const Floats determinant = n * vv - v * v;  // an integer, 0 if all weights are equal
    const Floats scale = splat(1.0F / kTexelScale) / maximum(determinant, splat(1.0F));
    const Floats inverse_n = splat(1.0F) / n;
    const Floats lift = interpolated_count<kSteps>(moments) * splat(kInterpolationLoss * kTexelScale);
    Line line;
    for (int c = 0; c < 3; ++c) {
        const Floats sum = sums.channel[c];
        const Floats vx = splat(2.0F) * moments.wx[c] - splat(kK) * sum;
        line.half[c] = (n * vx - v * sum) * scale;
        line.mid[c] = ((sum + lift) * splat(1.0F / kTexelScale) - v * line.half[c]) * inverse_n;
    }
    return line;
}

template <int kBits>
inline Ints quantized(Floats level) {
    constexpr float kLargest = static_cast<float>((1 << kBits) - 1);
    const Floats scaled = level * splat(kLargest / 255.0F) + splat(0.5F);
    return truncate(minimum(maximum(scaled, splat(0.0F)), splat(kLargest)));
}

template <int kBits>
inline Floats decoded(Ints code) {
    return to_floats(shift_left32<8 - kBits>(code) | shift_right32<2 * kBits - 8>(code));
}

/// Rounds one channel after Babai (nearest plane): the high level to the nearest code, the low one to the code that is
/// best with it, which moves by `low_by_high` for each level that the high one was moved. (Trying both codes around the
/// high level gains 0.01 dB, 0.2 on water, and costs a fifth of the time.)
template <int kSteps, int kBits>
inline void round_channel(Floats low_by_high, const Line& line, int c, Endpoints& ends) {
    const Floats reach = splat(static_cast<float>(kSteps)) * line.half[c];
    const Floats high = line.mid[c] + reach;
    const Floats low = line.mid[c] - reach;
    ends.high[c] = quantized<kBits>(high);
    const Floats high_level = decoded<kBits>(ends.high[c]);
    ends.low[c] = quantized<kBits>(low - low_by_high * (high_level - high));
    const Floats low_level = decoded<kBits>(ends.low[c]);
    ends.line.mid[c] = splat(0.5F) * (high_level + low_level);
    ends.line.half[c] = splat(0.5F / kSteps) * (high_level - low_level);
}

/// The codes near the line. The error rises with dh^2 Sum w^2 + 2 dh dl Sum w(k-w) + dl^2 Sum (k-w)^2.
template <int kSteps>
inline Endpoints rounded(const Line& line, const Moments& moments, Floats n) {
    constexpr auto kK = static_cast<float>(kSteps);
    const Floats high_low = splat(kK) * moments.w - moments.ww;
    const Floats low_low = splat(kK * kK) * n - splat(2.0F * kK) * moments.w + moments.ww;
    const Floats low_by_high = high_low / maximum(low_low, splat(1.0F));
    Endpoints ends;
    round_channel<kSteps, 5>(low_by_high, line, 0, ends);
    round_channel<kSteps, 6>(low_by_high, line, 1, ends);
    round_channel<kSteps, 5>(low_by_high, line, 2, ends);
    return ends;
}

inline Ints packed565(const Ints code[3]) { return shift_left32<11>(code[0]) | shift_left32<5>(code[1]) | code[2]; }

/// What the stages hand on about kLanes blocks.
struct Group {
    const uint8_t* rgba;
    uint8_t* out;
    Texels texels;
    Sums sums;
    Axis axis;
    Moments moments;
    Endpoints ends;
    Weights weights;
    unsigned transparent;  // lanes whose block has a transparent texel
    unsigned plain;        // lanes that one colour represents best
};

/// Two bits a texel: texels 0..7 fill the low half and 8..15 the high half, as the format has them.
inline Ints packed_weights(const Weights& weights) {
    Ints w = weights.pair[kPairs - 1];
    for (int i = kPairs - 2; i >= 0; --i) {
        w = shift_left16<2>(w) | weights.pair[i];
    }
    return w;
}

constexpr int kLowBits = 0x55555555;

/// As the format has them.
struct Packed {
    Ints ends;
    Ints selectors;
};

/// Four-colour mode wants the greater endpoint first.
inline Packed packed_in_four(const Endpoints& ends, const Weights& weights) {
    const Ints w = packed_weights(weights);
    // Weight 3, 0, 2, 1 is selector 0, 1, 2, 3.
    const Ints flipped =
        ((w ^ shift_left32<1>(w)) & splat(~kLowBits)) | (shift_right32<1>(w ^ splat(-1)) & splat(kLowBits));
    const Ints high = packed565(ends.high);
    const Ints low = packed565(ends.low);
    // Exchanging the endpoints flips the low bit of each selector.
    const Mask exchange = less32(high, low);
    const Ints first = select(exchange, low, high);
    const Ints second = select(exchange, high, low);
    return {first | shift_left32<16>(second), flipped ^ select(exchange, splat(kLowBits), zero())};
}

/// Three-colour mode wants the greater endpoint second.
inline Packed packed_in_three(const Endpoints& ends, const Weights& weights) {
    const Ints high = packed565(ends.high);
    const Ints low = packed565(ends.low);
    // Weight 0, 2, 1 is selector 0, 1, 2, and 1, 0, 2 after an exchange.
    const Mask exchange = less32(high, low);
    const Ints w = packed_weights(weights);
    const Ints middle = shift_left32<1>(w & splat(kLowBits));
    const Ints far = shift_right32<1>(w) & splat(kLowBits);
    const Ints near = (far | shift_right32<1>(middle)) ^ splat(kLowBits);
    const Ints first = select(exchange, high, low);
    const Ints second = select(exchange, low, high);
    return {first | shift_left32<16>(second), select(exchange, near, far) | middle};
}

/// Lanes whose endpoints are alike.
inline unsigned collapsed(const Endpoints& ends) {
    return lane_bits(equal32(packed565(ends.high), packed565(ends.low)));
}

inline void write_group(Group& group) {
    const Packed packed = packed_in_four(group.ends, group.weights);
    store_blocks(group.out, packed.ends, packed.selectors);
    group.plain |= collapsed(group.ends);
}

/// Runs each stage over all groups of the batch before the next one: a stage is a long chain of dependent operations,
/// and the processor overlaps the chains of neighbouring groups only if they lie within its window.
inline void encode_batch(Group* groups, size_t group_count, size_t row_bytes) {
    const Floats n = splat(16.0F);
    for (size_t g = 0; g < group_count; ++g) {
        Group& group = groups[g];
        group.transparent = lane_bits(load_texels(group.rgba, row_bytes, group.texels));
        group.sums = sum_texels(group.texels);
    }
    for (size_t g = 0; g < group_count; ++g) {
        groups[g].axis = principal_axis(groups[g].texels, groups[g].sums, n, groups[g].plain);
    }
    for (size_t g = 0; g < group_count; ++g) {
        groups[g].weights = first_weights<3>(groups[g].texels, groups[g].axis, kCutInFour, nullptr);
    }
    for (int fit = 0; fit < kFits; ++fit) {
        for (size_t g = 0; g < group_count; ++g) {
            groups[g].moments = moments_of(groups[g].texels, groups[g].weights);
        }
        for (size_t g = 0; g < group_count; ++g) {
            const Line line = fit_line<3>(groups[g].sums, groups[g].moments, n);
            groups[g].ends = rounded<3>(line, groups[g].moments, n);
        }
        for (size_t g = 0; g < group_count; ++g) {
            groups[g].weights = weights_for<3>(groups[g].texels, groups[g].ends.line, nullptr);
        }
    }
    for (size_t g = 0; g < group_count; ++g) {
        write_group(groups[g]);
    }
}

// Blocks with transparent texels: gathered from wherever they stand until they fill a group.

struct MixedBlocks {
    uint8_t rgba[4][kLanes * 16];
    uint8_t* out[kLanes];
    size_t count;
};

/// Texels' masks, both halves; transparent texels become black. Returns the number of opaque ones.
inline Floats load_opaque(const MixedBlocks& blocks, Texels& texels, Ints opaque[kPairs]) {
    Ints count = zero();
    for (int y = 0; y < 2; ++y) {
        Ints upper[4];
        Ints lower[4];
        load_row(blocks.rgba[y], upper);
        load_row(blocks.rgba[y + 2], lower);
        for (int x = 0; x < 4; ++x) {
            const int i = 4 * y + x;
            opaque[i] = (shift_right_signed32<31>(upper[x]) & splat(0xFFFF)) |
                        shift_left32<16>(shift_right_signed32<31>(lower[x]));
            count = add16(count, opaque[i]);
            for (int c = 0; c < 3; ++c) {
                texels.channel[c][i] = texels.channel[c][i] & opaque[i];
            }
        }
    }
    return to_floats(mul_add_pairs(count, splat(-1)));
}

/// Encodes the blocks gathered: three colours, fitted to the opaque texels.
inline void encode_mixed(MixedBlocks& blocks) {
    Texels texels;
    Ints opaque[kPairs];
    load_texels(blocks.rgba[0], kLanes * 16, texels);
    const Floats n = maximum(load_opaque(blocks, texels, opaque), splat(1.0F));
    const Sums sums = sum_texels(texels);
    unsigned plain = 0;
    const Axis axis = principal_axis(texels, sums, n, plain);
    Weights weights = first_weights<2>(texels, axis, kCutInThree, opaque);
    Endpoints ends;
    for (int fit = 0; fit < kFits; ++fit) {
        const Moments moments = moments_of(texels, weights);
        ends = rounded<2>(fit_line<2>(sums, moments, n), moments, n);
        weights = weights_for<2>(texels, ends.line, opaque);
    }
    Weights transparent;
    for (int i = 0; i < kPairs; ++i) {
        transparent.pair[i] = (opaque[i] ^ splat(-1)) & splat(0x00030003);
    }
    plain |= collapsed(ends);
    const Packed packed = packed_in_three(ends, weights);
    uint8_t out[kLanes * 8];
    store_blocks(out, packed.ends, packed.selectors | packed_weights(transparent));
    for (size_t lane = 0; lane < kLanes; ++lane) {
        const size_t block = kBlockOfLane[lane];
        if (block >= blocks.count) {
            continue;
        }
        if ((plain >> lane & 1U) != 0) {
            encode_bc1_plain_block(blocks.rgba[0] + block * 16, kLanes * 16, blocks.out[block]);
        } else {
            __builtin_memcpy(blocks.out[block], out + block * 8, 8);
        }
    }
    blocks.count = 0;
}

inline void add_mixed(MixedBlocks& blocks, const uint8_t* rgba, size_t row_bytes, uint8_t* out) {
    for (size_t y = 0; y < 4; ++y) {
        __builtin_memcpy(blocks.rgba[y] + blocks.count * 16, rgba + y * row_bytes, 16);
    }
    blocks.out[blocks.count++] = out;
    if (blocks.count == kLanes) {
        encode_mixed(blocks);
    }
}

/// Blocks that the kernel has left aside.
inline void finish_group(const Group& group, size_t row_bytes, MixedBlocks& mixed) {
    if ((group.plain | group.transparent) == 0) {
        return;
    }
    float sums[3][kLanes];
    __builtin_memcpy(sums, &group.sums, sizeof sums);
    for (unsigned lanes = group.plain | group.transparent; lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<size_t>(__builtin_ctz(lanes));
        const size_t block = kBlockOfLane[lane];
        if ((group.transparent >> lane & 1U) != 0) {
            add_mixed(mixed, group.rgba + block * 16, row_bytes, group.out + block * 8);
        } else {
            int mean[3];
            for (int c = 0; c < 3; ++c) {
                mean[c] = (static_cast<int>(sums[c][lane]) + (8 << kTexelShift)) >> (4 + kTexelShift);
            }
            encode_bc1_solid_block(mean, group.out + block * 8);
        }
    }
}

/// Whether each block of the group has one colour and one alpha, which most groups deny with their first texels.
inline bool is_plain_group(const uint8_t* rgba, size_t row_bytes) {
    for (int k = 0; k < 4; ++k) {
        const uint8_t* blocks = rgba + static_cast<size_t>(k) * kLanes * 4;
        const Ints row = load(blocks);
        const Ints first = first_of_16_bytes(row);
        Ints differs = row ^ first;
        for (size_t y = 1; y < 4; ++y) {
            differs = differs | (load(blocks + y * row_bytes) ^ first);
        }
        if (!is_zero(differs)) {
            return false;
        }
    }
    return true;
}

/// Seas and margins are full of such groups.
inline void encode_plain_group(const uint8_t* rgba, uint8_t* out) {
    uint32_t last = 0;
    for (size_t block = 0; block < kLanes; ++block) {
        const uint8_t* texel = rgba + block * 16;
        uint32_t colour;
        __builtin_memcpy(&colour, texel, 4);
        if (block != 0 && colour == last) {
            __builtin_memcpy(out + block * 8, out + block * 8 - 8, 8);
            continue;
        }
        last = colour;
        if (texel[3] < 128) {
            __builtin_memcpy(out + block * 8, kBc1Transparent, 8);
        } else {
            const int solid[3] = {texel[0], texel[1], texel[2]};
            encode_bc1_solid_block(solid, out + block * 8);
        }
    }
}

template <void (*kEncodeBatch)(Group* groups, size_t group_count, size_t row_bytes)>
inline void encode_groups(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    Group groups[kBatchGroups];
    MixedBlocks mixed;
    __builtin_memset(mixed.rgba, 0, sizeof mixed.rgba);
    mixed.count = 0;
    size_t gathered = 0;
    for (size_t block = 0; block < block_count; block += kLanes) {
        if (is_plain_group(rgba + block * 16, row_bytes)) {
            encode_plain_group(rgba + block * 16, out + block * 8);
        } else {
            groups[gathered].rgba = rgba + block * 16;
            groups[gathered].out = out + block * 8;
            ++gathered;
        }
        if (gathered == kBatchGroups || (gathered != 0 && block + kLanes == block_count)) {
            kEncodeBatch(groups, gathered, row_bytes);
            for (size_t g = 0; g < gathered; ++g) {
                finish_group(groups[g], row_bytes, mixed);
            }
            gathered = 0;
        }
    }
    if (mixed.count != 0) {
        encode_mixed(mixed);
    }
}
