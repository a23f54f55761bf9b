// Track: follows one value of a stream and says which samples contradict its motion
// (models/gate/README.md, "One value"). The value is an angle, a rotation or a position; a Space
// says what steps and distances are. RT-safe; no allocation.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "proto/frame/rt_safe.hpp"

namespace posed::gate {

// What a value may do [its unit].
struct Bounds {
  float jump = 0.0F;          // always allowed from one sample to the next
  float acceleration = 0.0F;  // per s^2: what people do
};

struct AngleSpace {  // rad, may wrap
  using Value = float;
  RT_SAFE static float distance(float a, float b) noexcept { return std::abs(wrapped(a - b)); }
  // Where a motion from `a` to `b` is `ratio` of that time later.
  RT_SAFE static float ahead(float a, float b, float ratio) noexcept {
    return b + ratio * wrapped(b - a);
  }

 private:
  RT_SAFE static float wrapped(float angle) noexcept {
    constexpr auto kTurn = static_cast<float>(2.0 * std::numbers::pi);
    return std::abs(angle) < 0.5F * kTurn ? angle : std::remainder(angle, kTurn);
  }
};

struct TurnSpace {  // a rotation; distances in rad, by the chord
  using Value = Eigen::Quaternionf;
  RT_SAFE static float distance(const Value& a, const Value& b) noexcept {
    return 2.0F * (a.conjugate() * b).vec().norm();
  }
  RT_SAFE static Value ahead(const Value& a, const Value& b, float ratio) noexcept {
    Value step = a.conjugate() * b;
    if (step.w() < 0.0F) step.coeffs() = -step.coeffs();
    step.vec() *= ratio;
    step.w() = 1.0F + ratio * (step.w() - 1.0F);
    return (b * step).normalized();
  }
};

struct PlaceSpace {  // m
  using Value = Eigen::Vector3f;
  RT_SAFE static float distance(const Value& a, const Value& b) noexcept { return (a - b).norm(); }
  RT_SAFE static Value ahead(const Value& a, const Value& b, float ratio) noexcept {
    return b + ratio * (b - a);
  }
};

template <typename Space>
class Track {
 public:
  using Value = typename Space::Value;

  // Whether this sample is believed. `dt_s`: since the frame before, above 0.
  RT_SAFE [[nodiscard]] bool accept(const Value& value, float dt_s, const Bounds& bounds) noexcept {
    since_s_ += dt_s;
    if (!known_ || since_s_ > kForgets_s) return begin(value);
    const float moved = Space::distance(last_, value);
    // Gloves are polled faster than they measure: the same value once more is no sample of its own,
    // and what comes after it is as far as from two steps.
    if (moved == 0.0F && since_s_ < kRepeats * dt_s) return true;
    const float off = std::min(moved, distance_to_prediction(value));
    const float reach_s = std::min(since_s_, 2.0F * dt_s);
    const float limit =
        std::max({kUnusual * usual_, bounds.jump, bounds.acceleration * reach_s * reach_s});
    if (off <= limit) {
      follow(value);
      usual_ += kLearn * (std::min(off, kUnusual * usual_ + 0.25F * bounds.jump) - usual_);
      return true;
    }
    // Samples that agree against the past are a motion: two of one that goes on, three of a step,
    // because a fault may last for two.
    const bool agrees = doubts_ > 0 && Space::distance(doubt_, value) < kAgree * moved;
    const bool goes_on = agrees && moved > kGoesOn * Space::distance(last_, doubt_);
    if (goes_on || (agrees && doubts_ >= 2)) {
      last_ = value;
      step_s_ = since_s_ = 0.0F;
      doubts_ = 0;
      return true;
    }
    doubts_ = agrees ? doubts_ + 1 : 1;
    doubt_ = value;
    return false;
  }

  // There was no sample in a frame `dt_s` after the one before.
  RT_SAFE void skip(float dt_s) noexcept {
    since_s_ += dt_s;
    doubts_ = 0;
  }
  RT_SAFE void forget() noexcept { *this = {}; }
  RT_SAFE [[nodiscard]] const Value& last() const noexcept { return last_; }

 private:
  static constexpr float kForgets_s = 0.25F;  // what is older says nothing, and nothing is held
  static constexpr float kUnusual = 6.0F;     // times the mean distance from the prediction
  static constexpr float kLearn = 0.03F;
  static constexpr float kAgree = 0.75F;
  static constexpr float kGoesOn = 1.2F;
  static constexpr float kRepeats = 2.5F;

  RT_SAFE [[nodiscard]] float distance_to_prediction(const Value& value) const noexcept {
    if (!(step_s_ > 0.0F)) return Space::distance(last_, value);
    const float ratio = std::min(since_s_ / step_s_, 3.0F);
    return Space::distance(Space::ahead(before_, last_, ratio), value);
  }
  RT_SAFE bool begin(const Value& value) noexcept {
    last_ = value;
    known_ = true;
    doubts_ = 0;
    step_s_ = since_s_ = 0.0F;
    return true;
  }
  RT_SAFE void follow(const Value& value) noexcept {
    before_ = last_;
    last_ = value;
    step_s_ = since_s_;
    since_s_ = 0.0F;
    doubts_ = 0;
  }

  Value before_{}, last_{}, doubt_{};
  float step_s_ = 0.0F;   // from before_ to last_; 0: before_ is not known
  float since_s_ = 0.0F;  // since last_
  float usual_ = 0.0F;    // mean distance from the prediction
  bool known_ = false;
  int doubts_ = 0;  // samples dropped in a row that agree; the last was doubt_
};

}  // namespace posed::gate
