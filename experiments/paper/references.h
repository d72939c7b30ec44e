// What the paper and the prototype of Scree lod, section 6, measured. The paper: its own 40 m data, a Pentium III at
// 660 MHz. The prototype: the 30 m window of Taipei, another path of the same kind.
#pragma once

#include <array>

namespace scree::paper {

/// Ueng & Chuang, Tables 1 to 3, and the prototype's P1 and T1 beside them. s = 0: without a cache. Shares in percent.
struct CachingReference {
    double tau_px, s_px;
    double paper_triangles, paper_ms, paper_missing;
    double triangles, ms, missing_p1, missing_t1, reused_p1, reused_t1, worst_p1, worst_t1;
};
inline constexpr std::array<CachingReference, 10> kCachingReferences{{
    {0.5, 0, 49097, 34.8, 0, 49681, 0.92, 0, 0, 0, 0, 1, 1},
    {0.5, 0.05, 47487, 1.2, 1.5, 48149, 0.030, 1.85, 1.49, 97.1, 95.9, 1.107, 1.094},
    {0.5, 0.10, 45972, 0.7, 3.4, 46657, 0.024, 3.82, 2.82, 98.4, 97.7, 1.242, 1.188},
    {1, 0, 25158, 23.7, 0, 26131, 0.79, 0, 0, 0, 0, 1, 1},
    {1, 0.05, 24595, 1.4, 0.7, 25522, 0.038, 1.11, 0.89, 94.5, 92.6, 1.051, 1.047},
    {1, 0.10, 24025, 0.8, 1.7, 24909, 0.059, 2.31, 1.77, 97.1, 95.9, 1.108, 1.095},
    {1, 0.20, 22950, 0.6, 3.8, 23703, 0.063, 4.92, 3.45, 98.4, 97.7, 1.242, 1.188},
    {2, 0, 11277, 13.3, 0, 10804, 0.33, 0, 0, 0, 0, 1, 1},
    {2, 0.10, 11028, 0.9, 0.6, 10517, 0.046, 1.16, 0.86, 94.5, 92.6, 1.051, 1.047},
    {2, 0.20, 10770, 0.7, 1.3, 10223, 0.024, 2.44, 1.76, 97.1, 95.9, 1.104, 1.092},
}};

/// The prototype's errors within blocks, without a cache and with strips that its metric does not know of.
struct TruthReference {
    const char* metric;
    double tau_px, triangles, max_px, p99_px, mean_px;
};
inline constexpr std::array<TruthReference, 12> kTruthReferences{{
    {"UC", 0.5, 49681, 0.99, 0.50, 0.113},
    {"UC", 1, 26130, 1.90, 1.01, 0.275},
    {"UC", 2, 10805, 3.91, 2.02, 0.562},
    {"N*", 0.5, 50409, 0.57, 0.49, 0.108},
    {"N*", 1, 27341, 1.13, 0.95, 0.253},
    {"N*", 2, 12016, 2.26, 1.78, 0.496},
    {"N*K", 0.5, 58743, 0.44, 0.39, 0.077},
    {"N*K", 1, 34554, 0.90, 0.76, 0.194},
    {"N*K", 2, 16156, 1.81, 1.44, 0.403},
    {"BSK", 0.5, 62431, 0.41, 0.35, 0.067},
    {"BSK", 1, 38723, 0.82, 0.69, 0.171},
    {"BSK", 2, 19737, 1.65, 1.30, 0.365},
}};

/// Share of blocks reused at tau 1, s 0.1, percent.
struct SpeedReference {
    double step_m, reused_p1, reused_t1;
};
inline constexpr std::array<SpeedReference, 5> kSpeedReferences{
    {{2, 99.4, 99.2}, {5, 98.8, 98.3}, {15, 97, 95}, {30, 94.4, 92.1}, {60, 90.3, 86.9}}};

/// Full resolution of 660 x 660 samples: 74 more than the paper counts (Scree lod, C8).
inline constexpr long kCompleteTriangles = 868562;

}  // namespace scree::paper
