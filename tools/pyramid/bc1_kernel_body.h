// The vector kernel of the BC1 encoder. Included inside the anonymous namespace of bc1_kernel_<instruction set>.cpp,
// which defines the vector types and operations that it is written in: no #pragma once, no includes.
//
// Layout: a 32-bit lane stands for a block, its two 16-bit halves for two texels of that block, texel i in the low half
// and texel i + 8 in the high one, i = 0..7. Work on texels runs in 16-bit halves, a sum over the texels of a block is
// one multiply-add of pairs into its 32-bit lane, and what is decided once a block (axis, least squares) runs in 32-bit
// floats in the very same lanes. No lane looks at another one, so the number of lanes does not change the result;
// floats use + - * / min max and truncation alone, in one fixed order.
//
// Ideas from: S. Brown, squish (principal axis; least squares for given selectors); F. Giesen, stb_dxt (selectors from
// the projection on the endpoint axis; refinement rounds); R. Geldreich, rgbcx and I. Castano, icbc (endpoints rounded
// with regard to the error, not each for itself). The rounding is Babai's nearest plane with two candidates.

/// Texel values are stored times 32: then 16 products of two still fit 31 bits, and the high half of a 32-bit product
/// with a 15-bit axis keeps a resolution of 1/16 level.
constexpr int kTexelShift = 5;
constexpr float kTexelScale = 32.0F;
constexpr int kPairs = 8;

/// By how many levels a decoder shows the two interpolated colours below their exact value, in the mean: 1/3 if it
/// rounds down, 0 if it rounds to nearest; GPUs do either (F. Giesen notes which in stb_dxt). Half way is within 0.01
/// dB of the best for both; 0 would cost 0.2 dB on smooth images in a decoder that rounds down.
constexpr float kInterpolationLoss = 1.0F / 6.0F;

/// Least-squares fits. The second one gains 0.10 dB and costs a quarter of the time; a third one would gain 0.006 dB
/// for another fifth.
constexpr int kFits = 2;

/// Groups that go through a stage together. 2 to 8 run alike, 1 is a fifth slower; 4 of the widest take 14 KB of stack.
constexpr size_t kBatchGroups = 4;

struct Texels {
    Ints channel[3][kPairs];
};

/// Sums over the 16 texels of a block, times 32.
struct Sums {
    Floats channel[3];
};

struct Axis {
    Ints channel[3];  // both halves alike
};

/// w counts the thirds of the way from endpoint low (0) to endpoint high (3).
struct Weights {
    Ints pair[kPairs];
};

/// What least squares needs to know of the weights: sums of w, w*w and w*texel (times 32) over the block.
struct Moments {
    Floats w;
    Floats ww;
    Floats wx[3];
};

struct Endpoints {
    Ints high[3];  // 5, 6, 5 bits
    Ints low[3];
    Floats high_level[3];  // as decoded, 0..255
    Floats low_level[3];
};

inline Ints both_halves(Ints a) { return shift_left32<16>(a) | (a & splat(0xFFFF)); }
inline Ints low_half_signed(Ints a) { return shift_right_signed32<16>(shift_left32<16>(a)); }

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

/// 16 * 32^2 times the scatter matrix; exact, every term being a 24-bit integer times 2^10.
inline Symmetric scatter(const Texels& texels, const Sums& sums) {
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
        rr = add32(rr, mul_add_pairs(r, r));
        rg = add32(rg, mul_add_pairs(r, g));
        rb = add32(rb, mul_add_pairs(r, b));
        gg = add32(gg, mul_add_pairs(g, g));
        gb = add32(gb, mul_add_pairs(g, b));
        bb = add32(bb, mul_add_pairs(b, b));
    }
    const Floats n = splat(16.0F);
    const Floats r = sums.channel[0];
    const Floats g = sums.channel[1];
    const Floats b = sums.channel[2];
    return {n * to_floats(rr) - r * r, n * to_floats(rg) - r * g, n * to_floats(rb) - r * b,
            n * to_floats(gg) - g * g, n * to_floats(gb) - g * b, n * to_floats(bb) - b * b};
}

/// The direction scaled so that its largest component is 32767. `scale` receives the factor.
inline Axis scaled_axis(const Floats direction[3], Floats smallest, Floats& scale) {
    const Floats largest = maximum(maximum(magnitude(direction[0]), magnitude(direction[1])), magnitude(direction[2]));
    scale = splat(32767.0F) / maximum(largest, smallest);
    Axis axis;
    for (int c = 0; c < 3; ++c) {
        axis.channel[c] = both_halves(truncate(direction[c] * scale));
    }
    return axis;
}

/// The eigenvector of the largest eigenvalue: the longest column of the fourth power of the scatter matrix.
/// `solid` receives the lanes whose block has one colour.
inline Axis principal_axis(const Texels& texels, const Sums& sums, unsigned& solid) {
    const Symmetric s = scatter(texels, sums);
    const Floats trace = s.rr + s.gg + s.bb;
    solid = lane_bits(less(trace, splat(1.0F)));
    const Floats scale = splat(1.0F) / maximum(trace, splat(1.0F));
    Symmetric m = {s.rr * scale, s.rg * scale, s.rb * scale, s.gg * scale, s.gb * scale, s.bb * scale};
    m = squared(squared(m));  // the largest eigenvalue is 1/3..1 of the trace: no underflow
    Floats direction[3] = {m.rr, m.rg, m.rb};
    const Mask green_longer = less(m.rr, m.gg);
    direction[0] = select(green_longer, m.rg, direction[0]);
    direction[1] = select(green_longer, m.gg, direction[1]);
    direction[2] = select(green_longer, m.gb, direction[2]);
    const Mask blue_longer = less(maximum(m.rr, m.gg), m.bb);
    direction[0] = select(blue_longer, m.rb, direction[0]);
    direction[1] = select(blue_longer, m.gb, direction[1]);
    direction[2] = select(blue_longer, m.bb, direction[2]);
    Floats unused;
    return scaled_axis(direction, splat(1e-20F), unused);
}

/// Along the axis; 16 a level for an axis of one channel. Truncated by 1.5 in the mean.
inline Ints projection(const Texels& texels, const Axis& axis, int pair) {
    return add16(add16(mul_high16(texels.channel[0][pair], axis.channel[0]),
                       mul_high16(texels.channel[1][pair], axis.channel[1])),
                 mul_high16(texels.channel[2][pair], axis.channel[2]));
}

/// 0..3: how many of the limits lie below.
inline Ints weight_along(Ints along, const Ints limit[3]) {
    const Ints w = increment_if_greater16(zero(), along, limit[0]);
    return increment_if_greater16(increment_if_greater16(w, along, limit[1]), along, limit[2]);
}

inline Moments moments_of(const Texels& texels, const Weights& weights) {
    Ints w_sum = zero();
    Ints ww_sum = zero();
    Ints wx_sum[3] = {zero(), zero(), zero()};
    for (int i = 0; i < kPairs; ++i) {
        const Ints w = weights.pair[i];
        w_sum = add16(w_sum, w);
        ww_sum = add32(ww_sum, mul_add_pairs(w, w));
        for (int c = 0; c < 3; ++c) {
            wx_sum[c] = add32(wx_sum[c], mul_add_pairs(w, texels.channel[c][i]));
        }
    }
    return {to_floats(mul_add_pairs(w_sum, splat(0x00010001))),
            to_floats(ww_sum),
            {to_floats(wx_sum[0]), to_floats(wx_sum[1]), to_floats(wx_sum[2])}};
}

/// How much of the scatter a line fitted through these weights explains.
inline Floats explained_scatter(const Moments& moments, const Sums& sums) {
    const Floats n = splat(16.0F);
    Floats covariance = splat(0.0F);
    for (int c = 0; c < 3; ++c) {
        const Floats wx = n * moments.wx[c] - moments.w * sums.channel[c];
        covariance = covariance + wx * wx;
    }
    return covariance / maximum(n * moments.ww - moments.w * moments.w, splat(1.0F));
}

/// The first guess: of several ways to cut the range along the principal axis the one that explains most scatter.
inline Moments first_moments(const Texels& texels, const Sums& sums, const Axis& axis) {
    // Shares of the range. Most texels lie between the extremes, which puts the outer limits nearer to the middle than
    // 1/6 and 5/6; the second and the third row are for blocks whose texels crowd at one end. Measured on aerial and
    // satellite images: 1/6, 3/6, 5/6 alone -0.24 dB, the first row alone -0.12 dB.
    constexpr int kCuts = 3;
    constexpr float kCut[kCuts][3] = {{0.22F, 0.50F, 0.78F}, {0.16F, 0.40F, 0.72F}, {0.28F, 0.60F, 0.84F}};
    Ints along[kPairs];
    along[0] = projection(texels, axis, 0);
    Ints smallest = along[0];
    Ints largest = along[0];
    for (int i = 1; i < kPairs; ++i) {
        along[i] = projection(texels, axis, i);
        smallest = min16(smallest, along[i]);
        largest = max16(largest, along[i]);
    }
    const Floats low = to_floats(low_half_signed(min16(smallest, shift_right_signed32<16>(smallest))));
    const Floats high = to_floats(low_half_signed(max16(largest, shift_right_signed32<16>(largest))));
    const Floats range = high - low;
    Moments best{};
    Floats best_explained = splat(-1.0F);
    for (int cut = 0; cut < kCuts; ++cut) {
        Ints limit[3];
        for (int k = 0; k < 3; ++k) {
            limit[k] = both_halves(truncate(low + range * splat(kCut[cut][k])));
        }
        Weights weights;
        for (int i = 0; i < kPairs; ++i) {
            weights.pair[i] = weight_along(along[i], limit);
        }
        const Moments moments = moments_of(texels, weights);
        const Floats explained = explained_scatter(moments, sums);
        const Mask better = less(best_explained, explained);
        best_explained = select(better, explained, best_explained);
        best.w = select(better, moments.w, best.w);
        best.ww = select(better, moments.ww, best.ww);
        for (int c = 0; c < 3; ++c) {
            best.wx[c] = select(better, moments.wx[c], best.wx[c]);
        }
    }
    return best;
}

/// Every texel to the nearest of the four colours, along the endpoint axis.
inline Weights weights_for(const Texels& texels, const Endpoints& ends) {
    Floats direction[3];
    for (int c = 0; c < 3; ++c) {
        direction[c] = ends.high_level[c] - ends.low_level[c];
    }
    Floats scale;
    const Axis axis = scaled_axis(direction, splat(1.0F), scale);
    scale = scale * splat(kTexelScale / 65536.0F);
    Floats low = splat(-1.5F);
    Floats length = splat(0.0F);
    Floats step_sum = splat(0.0F);
    for (int c = 0; c < 3; ++c) {
        const Floats step = direction[c] * scale;
        low = low + ends.low_level[c] * step;
        length = length + direction[c] * step;
        step_sum = step_sum + step;
    }
    Ints limit[3];
    const Floats loss = step_sum * splat(0.5F * kInterpolationLoss);
    const Floats middle = low - loss;  // between an endpoint and an interpolated colour; between two of these: - loss
    limit[0] = both_halves(truncate(middle + length * splat(1.0F / 6.0F)));
    limit[1] = both_halves(truncate(middle - loss + length * splat(3.0F / 6.0F)));
    limit[2] = both_halves(truncate(middle + length * splat(5.0F / 6.0F)));
    Weights weights;
    for (int i = 0; i < kPairs; ++i) {
        weights.pair[i] = weight_along(projection(texels, axis, i), limit);
    }
    return weights;
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

/// The quadratic form of the error around its minimum: hh*dh^2 + 2*hl*dh*dl + ll*dl^2.
struct ErrorForm {
    Floats hh, hl, ll;
    Floats low_by_high;  // hl / ll
};

/// Rounds one channel. Tries the two codes that enclose the best high level, for each the code nearest to the low level
/// that is best with it, and keeps the pair of smaller error.
template <int kBits>
inline void round_channel(const ErrorForm& form, Floats high, Floats low, int c, Endpoints& ends) {
    constexpr float kLargest = static_cast<float>((1 << kBits) - 1);
    const Floats scaled = minimum(maximum(high * splat(kLargest / 255.0F), splat(0.0F)), splat(kLargest));
    Ints high_code[2];
    high_code[0] = truncate(scaled);
    high_code[1] = truncate(minimum(scaled + splat(1.0F), splat(kLargest)));
    Ints low_code[2];
    Floats high_level[2];
    Floats low_level[2];
    Floats error[2];
    for (int k = 0; k < 2; ++k) {
        high_level[k] = decoded<kBits>(high_code[k]);
        const Floats high_off = high_level[k] - high;
        low_code[k] = quantized<kBits>(low - form.low_by_high * high_off);
        low_level[k] = decoded<kBits>(low_code[k]);
        const Floats low_off = low_level[k] - low;
        error[k] = (form.hh * high_off + splat(2.0F) * form.hl * low_off) * high_off + form.ll * low_off * low_off;
    }
    const Mask second = less(error[1], error[0]);
    ends.high[c] = select(second, high_code[1], high_code[0]);
    ends.low[c] = select(second, low_code[1], low_code[0]);
    ends.high_level[c] = select(second, high_level[1], high_level[0]);
    ends.low_level[c] = select(second, low_level[1], low_level[0]);
}

/// The endpoints of least squared error for these weights: the sum over texels of (high*w + low*(3-w) - 3*texel)^2.
inline Endpoints fit_endpoints(const Sums& sums, const Moments& moments) {
    ErrorForm form;
    form.hh = moments.ww;
    form.hl = splat(3.0F) * moments.w - form.hh;
    form.ll = splat(144.0F) - splat(6.0F) * moments.w + form.hh;
    form.low_by_high = form.hl / maximum(form.ll, splat(1.0F));
    const Floats determinant = form.hh * form.ll - form.hl * form.hl;  // an integer, 0 if all weights are equal
    const Mask singular = less(determinant, splat(0.5F));
    const Floats scale = splat(3.0F / kTexelScale) / maximum(determinant, splat(1.0F));
    Floats high[3];
    Floats low[3];
    // Aims higher where interpolated colours are shown lower. The sum of w over weights 1 and 2, and that of 3-w, is
    // taken as 3/2 of their number, which is hl / 2.
    const Floats lift = form.hl * splat(0.75F * kInterpolationLoss * kTexelScale);
    for (int c = 0; c < 3; ++c) {
        const Floats high_sum = moments.wx[c] + lift;
        const Floats low_sum = splat(3.0F) * sums.channel[c] - moments.wx[c] + lift;
        const Floats mean = sums.channel[c] * splat(1.0F / (16.0F * kTexelScale));
        high[c] = select(singular, mean, (high_sum * form.ll - low_sum * form.hl) * scale);
        low[c] = select(singular, mean, (low_sum * form.hh - high_sum * form.hl) * scale);
    }
    Endpoints ends;
    round_channel<5>(form, high[0], low[0], 0, ends);
    round_channel<6>(form, high[1], low[1], 1, ends);
    round_channel<5>(form, high[2], low[2], 2, ends);
    return ends;
}

inline Ints packed565(const Ints code[3]) { return shift_left32<11>(code[0]) | shift_left32<5>(code[1]) | code[2]; }

/// What the stages hand on about kLanes blocks.
struct Group {
    Texels texels;
    Sums sums;
    Axis axis;
    Moments moments;
    Endpoints ends;
    Weights weights;
    unsigned special;  // lanes that the special path has to write
};

inline void write_group(Group& group, uint8_t* out) {
    // Texels 0..7 fill the low half and 8..15 the high half, as the format has them.
    const Weights& weights = group.weights;
    Ints w = weights.pair[kPairs - 1];
    for (int i = kPairs - 2; i >= 0; --i) {
        w = shift_left16<2>(w) | weights.pair[i];
    }
    // Weight 3, 0, 2, 1 is selector 0, 1, 2, 3.
    const Ints flipped = ((w ^ shift_left32<1>(w)) & splat(static_cast<int>(0xAAAAAAAAU))) |
                         (shift_right32<1>(w ^ splat(-1)) & splat(0x55555555));
    const Ints high = packed565(group.ends.high);
    const Ints low = packed565(group.ends.low);
    // Four-colour mode wants the greater endpoint first; exchanging them flips the low bit of each selector.
    const Mask exchange = less32(high, low);
    const Ints first = select(exchange, low, high);
    const Ints second = select(exchange, high, low);
    const Ints selectors = flipped ^ select(exchange, splat(0x55555555), zero());
    store_blocks(out, first | shift_left32<16>(second), selectors);
    group.special |= lane_bits(equal32(high, low));
}

/// Runs each stage over all groups of the batch before the next one: a stage is a long chain of dependent operations,
/// and the processor overlaps the chains of neighbouring groups only if they lie within its window.
inline void encode_batch(const uint8_t* rgba, size_t row_bytes, size_t group_count, Group* groups, uint8_t* out) {
    for (size_t g = 0; g < group_count; ++g) {
        Group& group = groups[g];
        group.special = lane_bits(load_texels(rgba + g * kLanes * 16, row_bytes, group.texels));
        group.sums = sum_texels(group.texels);
    }
    for (size_t g = 0; g < group_count; ++g) {
        unsigned solid = 0;
        groups[g].axis = principal_axis(groups[g].texels, groups[g].sums, solid);
        groups[g].special |= solid;
    }
    for (size_t g = 0; g < group_count; ++g) {
        groups[g].moments = first_moments(groups[g].texels, groups[g].sums, groups[g].axis);
    }
    for (int round = 1;; ++round) {
        for (size_t g = 0; g < group_count; ++g) {
            groups[g].ends = fit_endpoints(groups[g].sums, groups[g].moments);
        }
        for (size_t g = 0; g < group_count; ++g) {
            groups[g].weights = weights_for(groups[g].texels, groups[g].ends);
        }
        if (round == kFits) {
            break;
        }
        for (size_t g = 0; g < group_count; ++g) {
            groups[g].moments = moments_of(groups[g].texels, groups[g].weights);
        }
    }
    for (size_t g = 0; g < group_count; ++g) {
        write_group(groups[g], out + g * kLanes * 8);
    }
}

inline void encode_groups(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    Group groups[kBatchGroups];
    const size_t group_count = block_count / kLanes;
    for (size_t first = 0; first < group_count; first += kBatchGroups) {
        const size_t count = group_count - first < kBatchGroups ? group_count - first : kBatchGroups;
        const uint8_t* batch = rgba + first * kLanes * 16;
        uint8_t* batch_out = out + first * kLanes * 8;
        encode_batch(batch, row_bytes, count, groups, batch_out);
        for (size_t g = 0; g < count; ++g) {
            unsigned special = groups[g].special;
            for (size_t lane = 0; special != 0; ++lane, special >>= 1) {
                if ((special & 1U) != 0) {
                    const size_t block = g * kLanes + kBlockOfLane[lane];
                    encode_bc1_special_block(batch + block * 16, row_bytes, batch_out + block * 8);
                }
            }
        }
    }
}
