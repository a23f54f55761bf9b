// Random numbers that are the same on every platform. Uniform and normal values are computed here
// from the generator's raw bits, because the distributions of the standard library may differ
// between libraries. Cold.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace posed {

class PortableRandom {
 public:
  explicit PortableRandom(std::uint32_t seed) : bits_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits_()) / 4294967295.0);
  }

  // 0 to count - 1.
  int below(int count) {
    return static_cast<int>(static_cast<double>(bits_()) / 4294967296.0 * count);
  }

  // Mean 0, standard deviation 1 (Box-Muller method).
  double normal() {
    const double u = (static_cast<double>(bits_()) + 1.0) / 4294967297.0;
    const double v = static_cast<double>(bits_()) / 4294967296.0;
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  }

 private:
  std::mt19937 bits_;
};

}  // namespace posed
