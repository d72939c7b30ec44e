// The kernel of high quality, included after bc1_kernel_body.h. Tries many endpoints for each block and keeps those of
// the least squared error: least squares from several cuts along two axes, in four and in three colours, then the
// neighbouring codes of each endpoint (R. Geldreich, rgbcx, searches so too). No lane looks at another one here either.

/// Six times the texels: in sixths of a level all of BC1's colours, and half the loss in showing them, are integers.
struct Sixths {
    Ints channel[3][kPairs];
};

inline Sixths sixths_of(const Texels& texels) {
    Sixths sixths;
    for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < kPairs; ++i) {
            sixths.channel[c][i] = mul_low16(shift_right16<kTexelShift>(texels.channel[c][i]), splat(0x00060006));
        }
    }
    return sixths;
}

template <int kBits>
inline Ints level_of(Ints code) {
    return shift_left32<8 - kBits>(code) | shift_right32<2 * kBits - 8>(code);
}

/// 36 times the squared error: below 2^27.
template <int kSteps>
inline Ints error_of(const Sixths& sixths, const Endpoints& ends, const Weights& weights) {
    const Ints high[3] = {level_of<5>(ends.high[0]), level_of<6>(ends.high[1]), level_of<5>(ends.high[2])};
    const Ints low[3] = {level_of<5>(ends.low[0]), level_of<6>(ends.low[1]), level_of<5>(ends.low[2])};
    Ints base[3];
    Ints step[3];
    for (int c = 0; c < 3; ++c) {
        base[c] = mul_low16(both_halves(low[c]), splat(0x00060006));
        step[c] = mul_low16(both_halves(sub16(high[c], low[c])), splat(6 / kSteps * 0x00010001));
    }
    Ints error = zero();
    for (int i = 0; i < kPairs; ++i) {
        const Ints w = weights.pair[i];
        // Interpolated colours, weights 1 and 2 of 3 or 1 of 2, are shown a sixth of a level lower.
        const Ints interpolated = (kSteps == 3 ? w ^ shift_right16<1>(w) : w) & splat(0x00010001);
        for (int c = 0; c < 3; ++c) {
            const Ints shown = sub16(add16(base[c], mul_low16(w, step[c])), interpolated);
            const Ints off = sub16(sixths.channel[c][i], shown);
            error = add_products(error, off, off);
        }
    }
    return error;
}

inline Line line_of(const Endpoints& ends, float steps) {
    const Floats high[3] = {decoded<5>(ends.high[0]), decoded<6>(ends.high[1]), decoded<5>(ends.high[2])};
    const Floats low[3] = {decoded<5>(ends.low[0]), decoded<6>(ends.low[1]), decoded<5>(ends.low[2])};
    Line line;
    for (int c = 0; c < 3; ++c) {
        line.mid[c] = splat(0.5F) * (high[c] + low[c]);
        line.half[c] = splat(0.5F / steps) * (high[c] - low[c]);
    }
    return line;
}

/// The search in one of the two modes.
template <int kSteps>
struct Search {
    const Texels& texels;
    const Sixths& sixths;
    const Sums& sums;
    Floats n = splat(16.0F);
    Ints opaque[kPairs];
    Endpoints best;
    Ints best_error = splat(0x7FFFFFFF);

    Search(const Texels& t, const Sixths& six, const Sums& s) : texels(t), sixths(six), sums(s) {
        for (int i = 0; i < kPairs; ++i) {
            opaque[i] = splat(-1);
        }
        for (int c = 0; c < 3; ++c) {
            best.high[c] = zero();
            best.low[c] = zero();
        }
    }

    Weights weights_of(const Endpoints& ends) const {
        return weights_for<kSteps>(texels, line_of(ends, static_cast<float>(kSteps)), opaque);
    }

    /// Keeps the endpoints in the lanes where they are better.
    void consider(const Endpoints& ends, const Weights& weights) {
        const Ints error = error_of<kSteps>(sixths, ends, weights);
        const Mask better = less32(error, best_error);
        best_error = select(better, error, best_error);
        for (int c = 0; c < 3; ++c) {
            best.high[c] = select(better, ends.high[c], best.high[c]);
            best.low[c] = select(better, ends.low[c], best.low[c]);
        }
    }

    void fit_from(Weights weights, int fits) {
        for (int fit = 0; fit < fits; ++fit) {
            const Moments moments = moments_of(texels, weights);
            const Endpoints ends = rounded<kSteps>(fit_line<kSteps>(sums, moments, n), moments, n);
            weights = weights_of(ends);
            consider(ends, weights);
        }
    }

    /// Moves the codes of channel c by so much.
    void try_neighbour(int c, int high_by, int low_by) {
        Endpoints ends = best;
        const Ints largest = splat(c == 1 ? 63 : 31);
        ends.high[c] = min16(max16(add32(ends.high[c], splat(high_by)), zero()), largest);
        ends.low[c] = min16(max16(add32(ends.low[c], splat(low_by)), zero()), largest);
        consider(ends, weights_of(ends));
    }

    void try_neighbours() {
        for (int c = 0; c < 3; ++c) {
            for (int high_by = -1; high_by <= 1; ++high_by) {
                for (int low_by = -1; low_by <= 1; ++low_by) {
                    if (high_by != 0 || low_by != 0) {
                        try_neighbour(c, high_by, low_by);
                    }
                }
            }
        }
    }

    void run(const Axis& principal) {
        constexpr float kScale = kSteps == 3 ? 1.0F : 1.5F;
        constexpr float kCentres[] = {-0.12F, 0.0F, 0.12F};
        constexpr float kDistances[] = {0.20F, 0.28F, 0.36F};
        for (const float centre : kCentres) {
            for (const float distance : kDistances) {
                fit_from(first_weights<kSteps>(texels, principal, {centre, kScale * distance, 100.0F}, opaque), 2);
            }
        }
        Axis grey;
        for (Ints& channel : grey.channel) {
            channel = splat(9459 * 0x00010001);  // 16383 / sqrt 3
        }
        const Axis axes[] = {principal, grey};
        for (const Axis& axis : axes) {
            fit_from(first_weights<kSteps>(texels, axis, {0.0F, kScale * kLimitDistance, kShortestRange}, opaque), 3);
        }
        for (int round = 0; round < 2; ++round) {
            fit_from(weights_of(best), 2);
            try_neighbours();
        }
    }
};

inline void encode_high_batch(Group* groups, size_t group_count, size_t row_bytes) {
    for (size_t g = 0; g < group_count; ++g) {
        Group& group = groups[g];
        group.transparent = lane_bits(load_texels(group.rgba, row_bytes, group.texels));
        group.sums = sum_texels(group.texels);
        group.axis = principal_axis(group.texels, group.sums, splat(16.0F), group.plain);
        const Sixths sixths = sixths_of(group.texels);
        Search<3> four(group.texels, sixths, group.sums);
        four.run(group.axis);
        Search<2> three(group.texels, sixths, group.sums);
        three.run(group.axis);
        const Packed in_four = packed_in_four(four.best, four.weights_of(four.best));
        const Packed in_three = packed_in_three(three.best, three.weights_of(three.best));
        const Mask three_better = less32(three.best_error, four.best_error);
        store_blocks(group.out, select(three_better, in_three.ends, in_four.ends),
                     select(three_better, in_three.selectors, in_four.selectors));
        group.plain |= collapsed(four.best) & ~lane_bits(three_better);
    }
}
