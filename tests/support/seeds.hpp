// Which seeds the property tests run. POSED_SEEDS=10000 runs that many instead of 200; POSED_SEED=n
// runs only seed n.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <utility>

namespace posed::test {

inline std::uint64_t number_of(const char* variable, std::uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

// Whether so few seeds run, as under a sanitizer, that some of what can happen need not happen.
inline bool few_seeds() {
  return number_of("POSED_SEED", 0) != 0 || number_of("POSED_SEEDS", 200) < 200;
}

// The seeds to run, first and last: POSED_SEED alone, or one of `part` of POSED_SEEDS.
inline std::pair<std::uint64_t, std::uint64_t> seeds(std::uint64_t part) {
  const std::uint64_t alone = number_of("POSED_SEED", 0);
  if (alone != 0) return {alone, alone};
  return {1, number_of("POSED_SEEDS", 200) / part};
}

}  // namespace posed::test
