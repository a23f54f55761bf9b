// How much each style of a model counts: shares of one, which glide to new values.
//
// Weights are relative: only their shares of the sum count; how much style there is altogether is
// alpha. A share that is not named is 0; without any, the model's first style has all.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "models/style/model/style_model.hpp"
#include "proto/frame/result.hpp"
#include "proto/text/short_text.hpp"

namespace posed::style {

// In the order of a model's styles; the sum is 1.
struct Shares {
  std::uint16_t count = 0;  // styles of the model
  std::array<double, kMaxStyles> of{};

  [[nodiscard]] std::span<const double> all() const noexcept { return {of.data(), count}; }
};

// All to the first of `count` styles.
[[nodiscard]] Shares first_alone(std::size_t count) noexcept;

// What people write, for a model with these styles: "feminine=0.6,elderly=0.4"; empty is
// first_alone(). The error lists the styles that there are. Cold.
Result<Shares> shares_of(std::string_view weights, std::span<const std::string> styles);
// Whether it can be right for any model: what does not need the styles' names. Cold.
Result<> check_weights(std::string_view weights);

// Writes shares as text: "feminine=0.6,elderly=0.4".
RT_SAFE void describe_shares(const Shares& shares, std::span<const std::string> styles,
                             ShortText& text) noexcept;

// The shares of a live filter. They move in a straight line, so that at most `step` of the mixture
// changes at once: sum |change| / 2 <= step. RT-safe.
class StyleWeights {
 public:
  void begin(const Shares& shares) noexcept;
  void aim(const Shares& shares) noexcept { target_ = shares; }
  void move(double step) noexcept;
  // Another model, whose styles have other places: shares stay with their names, a style that was
  // not there before has none, and without a common one first_alone() holds.
  void rename(std::span<const std::string> before, std::span<const std::string> after) noexcept;

  [[nodiscard]] bool moving() const noexcept { return now_.of != target_.of; }
  [[nodiscard]] const Shares& now() const noexcept { return now_; }
  [[nodiscard]] const Shares& target() const noexcept { return target_; }
  [[nodiscard]] std::span<const float> shares() const noexcept {
    return {single_.data(), now_.count};
  }

 private:
  void set_now(const Shares& shares) noexcept;

  Shares now_, target_;
  std::array<float, kMaxStyles> single_{};  // `now_`
};

}  // namespace posed::style
