// Numbers with a fixed count of decimals as text, for what is sent often: some times faster than
// std::to_chars. RT-safe.
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>

namespace posed::drivers {

inline constexpr std::array<char, 200> kDigitPairs = [] {  // "000102...99"
  std::array<char, 200> pairs{};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    pairs[i] = static_cast<char>('0' + (i % 2 == 0 ? i / 20 : i / 2 % 10));
  }
  return pairs;
}();

// Writes `parts` (0 or more) of 10^-decimals with all their decimals, such as 1500 with 3 as
// "1.500", and returns where the text ends: at most 21 - decimals characters before the point.
template <int decimals>
char* put_decimals(char* at, std::int64_t parts) noexcept {
  static_assert(decimals > 0 && decimals < 10);
  constexpr std::uint64_t kOne = [] {
    std::uint64_t one = 1;
    for (int i = 0; i < decimals; ++i) one *= 10;
    return one;
  }();
  const auto size = static_cast<std::uint64_t>(parts);
  const std::uint64_t whole = size / kOne;
  auto rest = static_cast<std::uint32_t>(size % kOne);
  if (whole < 100) {  // without a branch on the count of digits, which is guessed badly
    at[0] = kDigitPairs[2 * whole];
    at[whole < 10 ? 0 : 1] = kDigitPairs[2 * whole + 1];
    at += whole < 10 ? 1 : 2;
  } else {
    at = std::to_chars(at, at + 20, whole).ptr;
  }
  *at++ = '.';
  int digit = decimals;
  for (; digit > 1; digit -= 2, rest /= 100) {
    std::memcpy(at + digit - 2, kDigitPairs.data() + 2 * (rest % 100), 2);
  }
  if (digit == 1) *at = static_cast<char>('0' + rest);
  return at + decimals;
}

}  // namespace posed::drivers
