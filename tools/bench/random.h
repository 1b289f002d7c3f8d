/* SPDX-License-Identifier: BSD-3-Clause
 * Random numbers that are the same on every machine: the standard's distributions are not. */
#ifndef OUTCROP_BENCH_RANDOM_H
#define OUTCROP_BENCH_RANDOM_H

#include <cmath>
#include <cstdint>
#include <random>

namespace outcrop::bench {

/* The one seed of the bench; every set and image derives its own from it. */
constexpr std::uint64_t kSeed = 568817959;

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}

    /* In [0, 1). */
    double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

    double uniform(double low, double high) { return low + (high - low) * unit(); }

    /* In [0, n). */
    int below(int n) { return static_cast<int>(unit() * n); }

    /* Mean 0, standard deviation 1. */
    double normal()
    {
        const double radius = std::sqrt(-2 * std::log(1 - unit()));
        return radius * std::cos(2 * 3.14159265358979323846 * unit());
    }

private:
    std::mt19937_64 engine_;
};

} // namespace outcrop::bench
#endif
