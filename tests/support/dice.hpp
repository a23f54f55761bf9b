// Random draws that a seed determines.
#pragma once

#include <cstdint>
#include <random>

namespace posed::test {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  [[nodiscard]] int below(int count) {
    return std::uniform_int_distribution<int>(0, count - 1)(random_);
  }
  [[nodiscard]] double within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  [[nodiscard]] bool chance(double probability) { return within(0.0, 1.0) < probability; }
  [[nodiscard]] std::uint64_t seed() { return random_(); }

 private:
  std::mt19937_64 random_;
};

}  // namespace posed::test
