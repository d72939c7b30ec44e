// The kernel of high quality, included after bc1_kernel_body.h. Tries many endpoints for each block and keeps those of
// the least squared error: least squares from several cuts along two axes, then the neighbouring codes of each endpoint
// (R. Geldreich, rgbcx, searches so too). No lane looks at another one here either.

/// Six times the texels: in sixths of a level the four colours, and half the loss in showing them, are integers.
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
inline Ints error_of(const Sixths& sixths, const Endpoints& ends, const Weights& weights) {
    const Ints high[3] = {level_of<5>(ends.high[0]), level_of<6>(ends.high[1]), level_of<5>(ends.high[2])};
    const Ints low[3] = {level_of<5>(ends.low[0]), level_of<6>(ends.low[1]), level_of<5>(ends.low[2])};
    Ints base[3];
    Ints step[3];
    for (int c = 0; c < 3; ++c) {
        base[c] = mul_low16(both_halves(low[c]), splat(0x00060006));
        step[c] = mul_low16(both_halves(sub16(high[c], low[c])), splat(0x00020002));
    }
    Ints error = zero();
    for (int i = 0; i < kPairs; ++i) {
        const Ints w = weights.pair[i];
        // Interpolated colours, weights 1 and 2, are shown a sixth of a level lower.
        const Ints interpolated = (w ^ shift_right16<1>(w)) & splat(0x00010001);
        for (int c = 0; c < 3; ++c) {
            const Ints shown = sub16(add16(base[c], mul_low16(w, step[c])), interpolated);
            const Ints off = sub16(sixths.channel[c][i], shown);
            error = add_products(error, off, off);
        }
    }
    return error;
}

inline Line line_of(const Endpoints& ends) {
    const Floats high[3] = {decoded<5>(ends.high[0]), decoded<6>(ends.high[1]), decoded<5>(ends.high[2])};
    const Floats low[3] = {decoded<5>(ends.low[0]), decoded<6>(ends.low[1]), decoded<5>(ends.low[2])};
    Line line;
    for (int c = 0; c < 3; ++c) {
        line.mid[c] = splat(0.5F) * (high[c] + low[c]);
        line.half[c] = splat(0.5F / 3.0F) * (high[c] - low[c]);
    }
    return line;
}

/// Cuts of the range. Measured: the outer two gain 0.2 dB on roofs and streets, 0.02 elsewhere.
constexpr Cut kHighCuts[] = {{-0.08F, kLimitDistance, 100.0F},
                             {0.08F, kLimitDistance, 100.0F},
                             {-0.24F, kLimitDistance, 100.0F},
                             {0.24F, kLimitDistance, 100.0F}};

struct Search {
    const Texels& texels;
    const Sums& sums;
    Sixths sixths;
    Endpoints best;
    Ints best_error;

    Search(const Texels& t, const Sums& s) : texels(t), sums(s), sixths(sixths_of(t)), best_error(splat(0x7FFFFFFF)) {
        for (int c = 0; c < 3; ++c) {
            best.high[c] = zero();
            best.low[c] = zero();
        }
    }

    Weights weights_of(const Endpoints& ends) const { return weights_for<3>(texels, line_of(ends), nullptr); }

    /// Keeps the endpoints in the lanes where they are better.
    void consider(const Endpoints& ends, const Weights& weights) {
        const Ints error = error_of(sixths, ends, weights);
        const Mask better = less32(error, best_error);
        best_error = select(better, error, best_error);
        for (int c = 0; c < 3; ++c) {
            best.high[c] = select(better, ends.high[c], best.high[c]);
            best.low[c] = select(better, ends.low[c], best.low[c]);
        }
    }

    void fit_twice(Weights weights) {
        const Floats n = splat(16.0F);
        for (int fit = 0; fit < 2; ++fit) {
            const Moments moments = moments_of(texels, weights);
            const Endpoints ends = rounded<3>(fit_line<3>(sums, moments, n), moments, n);
            weights = weights_for<3>(texels, ends.line, nullptr);
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

    /// One endpoint up or down, or both, apart or together.
    void try_neighbours() {
        constexpr int kMoves[6][2] = {{-1, 0}, {0, -1}, {0, 1}, {1, 0}, {-1, 1}, {1, -1}};
        for (int c = 0; c < 3; ++c) {
            for (const int* move : kMoves) {
                try_neighbour(c, move[0], move[1]);
            }
        }
    }

    void run(const Axis& principal) {
        for (const Cut& cut : kHighCuts) {
            fit_twice(first_weights<3>(texels, principal, cut, nullptr));
        }
        fit_twice(first_weights<3>(texels, principal, kCutInFour, nullptr));
        Axis grey;
        for (Ints& channel : grey.channel) {
            channel = splat(9459 * 0x00010001);  // 16383 / sqrt 3
        }
        fit_twice(first_weights<3>(texels, grey, kCutInFour, nullptr));
        fit_twice(weights_of(best));
        try_neighbours();
    }
};

inline void encode_high_batch(Group* groups, size_t group_count, size_t row_bytes) {
    for (size_t g = 0; g < group_count; ++g) {
        Group& group = groups[g];
        group.transparent = lane_bits(load_texels(group.rgba, row_bytes, group.texels));
        group.sums = sum_texels(group.texels);
        group.axis = principal_axis(group.texels, group.sums, splat(16.0F), group.plain);
        Search search(group.texels, group.sums);
        search.run(group.axis);
        group.ends = search.best;
        group.weights = search.weights_of(search.best);
        write_group(group);
    }
}
