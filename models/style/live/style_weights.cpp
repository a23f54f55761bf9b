#include "models/style/live/style_weights.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/named_numbers.hpp"

namespace posed::style {
namespace {

constexpr double kMaxWeight = 1000.0;

double sum_of(const Shares& shares) noexcept {
  return std::accumulate(shares.of.begin(), shares.of.end(), 0.0);
}

void normalise(Shares& shares) noexcept {
  const double sum = sum_of(shares);
  for (double& share : shares.of) share /= sum;
}

Result<std::vector<NamedNumber>> parsed(std::string_view weights) {
  auto numbers = TRY(parse_named_numbers(weights, "weights", 0.0, kMaxWeight));
  const auto is_zero = [](const NamedNumber& one) { return one.number == 0.0; };
  if (!numbers.empty() && std::ranges::all_of(numbers, is_zero)) {
    return misuse("weights: all are 0, so there is nothing to mix; for no style, set alpha to 0");
  }
  return numbers;
}

// Without anything in common, `count` is 0.
RT_SAFE Shares renamed(const Shares& shares, std::span<const std::string> before,
                       std::span<const std::string> after) noexcept {
  Shares kept{.count = static_cast<std::uint16_t>(after.size())};
  for (std::size_t s = 0; s < shares.count; ++s) {
    const auto found = std::ranges::find(after, before[s]);
    if (found != after.end()) kept.of[found - after.begin()] = shares.of[s];
  }
  if (!(sum_of(kept) > 0.0)) return {};
  normalise(kept);
  return kept;
}

}  // namespace

Shares first_alone(std::size_t count) noexcept {
  Shares shares{.count = static_cast<std::uint16_t>(count)};
  shares.of[0] = 1.0;
  return shares;
}

Result<> check_weights(std::string_view weights) {
  TRY(parsed(weights));
  return {};
}

Result<Shares> shares_of(std::string_view weights, std::span<const std::string> styles) {
  const auto numbers = TRY(parsed(weights));
  if (numbers.empty()) return first_alone(styles.size());
  Shares shares{.count = static_cast<std::uint16_t>(styles.size())};
  for (const NamedNumber& one : numbers) {
    const auto found = std::ranges::find(styles, one.name);
    if (found == styles.end()) {
      return misuse("weights: the model has no style " + in_quotes(one.name) +
                    "; it has: " + joined(styles, ", ", clean_name));
    }
    shares.of[found - styles.begin()] = one.number;
  }
  normalise(shares);
  return shares;
}

RT_SAFE void describe_shares(const Shares& shares, std::span<const std::string> styles,
                             ShortText& text) noexcept {
  bool first = true;
  for (std::size_t s = 0; s < std::min<std::size_t>(shares.count, styles.size()); ++s) {
    if (shares.of[s] == 0.0) continue;
    std::array<char, 32> number{};
    const auto end = std::to_chars(number.data(), number.data() + number.size(), shares.of[s],
                                   std::chars_format::general, 3)
                         .ptr;
    text.add(first ? "" : ",");
    text.add(styles[s]);
    text.add("=");
    text.add({number.data(), end});
    first = false;
  }
}

RT_SAFE void StyleWeights::set_now(const Shares& shares) noexcept {
  now_ = shares;
  std::ranges::transform(now_.of, single_.begin(),
                         [](double share) { return static_cast<float>(share); });
}

RT_SAFE void StyleWeights::begin(const Shares& shares) noexcept {
  set_now(shares);
  target_ = shares;
}

RT_SAFE void StyleWeights::move(double step) noexcept {
  if (!moving()) return;
  double way = 0.0;
  for (std::size_t s = 0; s < now_.count; ++s) way += 0.5 * std::abs(target_.of[s] - now_.of[s]);
  Shares next = target_;
  if (step < way) {
    for (std::size_t s = 0; s < now_.count; ++s) {
      next.of[s] = now_.of[s] + step / way * (target_.of[s] - now_.of[s]);
    }
  }
  set_now(next);
}

RT_SAFE void StyleWeights::rename(std::span<const std::string> before,
                                  std::span<const std::string> after) noexcept {
  const Shares now = renamed(now_, before, after);
  target_ = renamed(target_, before, after);
  if (target_.count == 0) target_ = first_alone(after.size());
  set_now(now.count == 0 ? target_ : now);
}

}  // namespace posed::style
