// The vector kernels of geometric errors. Included inside the anonymous namespace of
// error_kernels_<instruction set>.cpp, which defines vectors of integers and of doubles and their operations: no
// #pragma once, no includes.

// --- leaf errors ---
//
// A block of 2 x 2 cells of stride s is a fan round its centre c. On one of its four sides, with the side's mid-vertex
// m, the vertex a steps out and b steps along from the centre (b <= a <= s) lies under the surface
//     2 s S = 2 s c + a (2 m - 2 c) + b (2 k - 2 m),
// k being the corner it goes towards. A thinned side has no mid-vertex: m is half the sum of its two corners.

struct Extremes {
    Ints high, low;
};

struct Tiles {
    const int32_t* samples;  // of the first lane
    const int32_t* present;
    int pitch;  // vertices in a row
};

// Vertices are kLeafErrorTiles integers apart.
struct Side {
    long centre;      // vertex index of the block's centre
    long out, along;  // steps of a and b
    int depth;        // a goes that far
    bool diagonals;   // whether b = a counts: neighbouring sides share those vertices
};

template <bool kMasked>
inline void look_at(const Tiles& tiles, long vertex, Ints surface, Shift times_2s, Extremes& extremes) {
    Ints difference = subtract(shift_left(load(tiles.samples + vertex * kLeafErrorTiles), times_2s), surface);
    if (kMasked) {
        difference = both(difference, load(tiles.present + vertex * kLeafErrorTiles));
    }
    extremes.high = maximum(extremes.high, difference);
    extremes.low = minimum(extremes.low, difference);
}

// Heights are doubled: twice the mid-vertex of a thinned side is an integer.
template <bool kMasked>
inline void look_at_side(const Tiles& tiles, const Side& side, Ints centre, Ints mid, Ints back, Ints ahead,
                         Ints centre_2s, Shift times_2s, Extremes& extremes) {
    const Ints step_out = subtract(mid, centre), step_back = subtract(back, mid), step_ahead = subtract(ahead, mid);
    Ints surface = centre_2s;
    for (int a = 1; a <= side.depth; ++a) {
        surface = add(surface, step_out);
        const long vertex = side.centre + a * side.out;
        look_at<kMasked>(tiles, vertex, surface, times_2s, extremes);
        Ints west = surface, east = surface;
        const int last = side.diagonals ? a : a - 1;
        for (int b = 1; b <= last; ++b) {
            west = add(west, step_back);
            east = add(east, step_ahead);
            look_at<kMasked>(tiles, vertex - b * side.along, west, times_2s, extremes);
            look_at<kMasked>(tiles, vertex + b * side.along, east, times_2s, extremes);
        }
    }
}

template <bool kMasked>
inline void look_at_block(const Tiles& tiles, int log2_stride, int bi, int bj, int blocks, Extremes& extremes) {
    const int s = 1 << log2_stride;
    const long east = 1, south = tiles.pitch;
    const long centre = (2 * bj + 1) * s * south + (2 * bi + 1) * s;
    const bool first_row = bj == 0, last_row = bj == blocks - 1, first_column = bi == 0, last_column = bi == blocks - 1;
    const auto doubled = [&](long vertex) {
        const Ints z = load(tiles.samples + vertex * kLeafErrorTiles);
        return add(z, z);
    };
    const Shift times_2s = shift_by(log2_stride + 1), times_s = shift_by(log2_stride);
    const Ints c = doubled(centre), c_2s = shift_left(c, times_s);
    const Ints nw = doubled(centre - s * south - s * east), ne = doubled(centre - s * south + s * east);
    const Ints sw = doubled(centre + s * south - s * east), se = doubled(centre + s * south + s * east);
    if (s > 1) {  // else it is the finest surface
        // The outermost vertices of the north and west sides are those of the block beyond, where there is one.
        const Side north{centre, -south, east, first_row ? s : s - 1, true};
        const Side west{centre, -east, south, first_column ? s : s - 1, false};
        look_at_side<kMasked>(tiles, north, c, doubled(centre - s * south), nw, ne, c_2s, times_2s, extremes);
        look_at_side<kMasked>(tiles, west, c, doubled(centre - s * east), nw, sw, c_2s, times_2s, extremes);
        look_at_side<kMasked>(tiles, {centre, south, east, s, true}, c, doubled(centre + s * south), sw, se, c_2s,
                              times_2s, extremes);
        look_at_side<kMasked>(tiles, {centre, east, south, s, false}, c, doubled(centre + s * east), ne, se, c_2s,
                              times_2s, extremes);
    }
    const auto thinned = [&](long out, long along, Ints back, Ints ahead) {
        look_at_side<kMasked>(tiles, {centre, out, along, s, true}, c, half(add(back, ahead)), back, ahead, c_2s,
                              times_2s, extremes);
    };
    if (first_row) {
        thinned(-south, east, nw, ne);
    }
    if (last_row) {
        thinned(south, east, sw, se);
    }
    if (first_column) {
        thinned(-east, south, nw, sw);
    }
    if (last_column) {
        thinned(east, south, ne, se);
    }
}

template <bool kMasked>
void errors_of(const Tiles& tiles, int n, int32_t* worst) {
    for (int g = 0; g < n; ++g) {
        const int blocks = 1 << (n - g - 1);
        Extremes extremes{zero(), zero()};
        for (int bj = 0; bj < blocks; ++bj) {
            for (int bi = 0; bi < blocks; ++bi) {
                if (g > 0 || bj == 0 || bi == 0 || bj == blocks - 1 || bi == blocks - 1) {
                    look_at_block<kMasked>(tiles, g, bi, bj, blocks, extremes);
                }
            }
        }
        store(worst + g * kLeafErrorTiles, maximum(extremes.high, subtract(zero(), extremes.low)));
    }
}

void leaf_errors_of(const int32_t* samples, const int32_t* present, int n, int32_t* worst) {
    for (int lane = 0; lane < kLeafErrorTiles; lane += kLanes) {
        const Tiles tiles{samples + lane, present == nullptr ? nullptr : present + lane, (1 << n) + 1};
        if (present == nullptr) {
            errors_of<false>(tiles, n, worst + lane);
        } else {
            errors_of<true>(tiles, n, worst + lane);
        }
    }
}

// --- distance from a plane ---

struct Span {
    int first, last;  // columns
};
inline Span part_of_row(TilePlane::Part part, int r, int m) {
    switch (part) {
        case TilePlane::south_west:
            return {0, r};
        case TilePlane::north_east:
            return {r, m};
        case TilePlane::north_west:
            return {0, m - r};
        case TilePlane::south_east:
            return {m - r, m};
        case TilePlane::whole:
            break;
    }
    return {0, m};
}

double distance_from_plane(const int32_t* samples, int n, double scale, const TilePlane& plane) {
    const int m = 1 << n;
    const Doubles scales = splat(scale), slope = splat(plane.per_column), steps = counting();
    Doubles high = splat(0.0), low = high;
    for (int r = 0; r <= m; ++r) {
        const int32_t* row = samples + r * (m + 1);
        const Doubles start = splat(plane.at_corner + r * plane.per_row);
        const Span part = part_of_row(plane.part, r, m);
        for (int k = part.first / kDoubles * kDoubles; k <= part.last; k += kDoubles) {
            const int from = k + kDoubles <= m + 1 ? k : m + 1 - kDoubles;  // the last ones overlap
            const Doubles column = add(splat(static_cast<double>(from)), steps);
            Doubles difference =
                subtract(multiply(scales, to_doubles(row + from)), add(start, multiply(slope, column)));
            if (plane.part != TilePlane::whole) {
                difference = zero_outside(difference, column, splat(static_cast<double>(part.first)),
                                          splat(static_cast<double>(part.last)));
            }
            high = maximum(high, difference);
            low = minimum(low, difference);
        }
    }
    double greatest[kDoubles];
    store(greatest, maximum(high, subtract(splat(0.0), low)));
    double result = 0;
    for (const double d : greatest) {
        result = d > result ? d : result;
    }
    return result;
}
