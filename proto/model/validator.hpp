// Collects the first thing that is wrong with a model that is being read, so that the reading stays
// one straight line.
#pragma once

#include <string>

#include "proto/frame/result.hpp"

namespace posed::model_file {

inline constexpr double kMaxNumber = 1e30;  // what the hot path's floats can still hold, multiply

class Validator {
 public:
  void want(bool condition, const char* what) {
    if (!condition && wrong_.empty()) wrong_ = what;
  }

  [[nodiscard]] bool sound() const { return wrong_.empty(); }

  double number(double value, double low, double high, const char* what) {
    want(value >= low && value <= high, what);  // false for NaN
    return value;
  }

  template <typename Range>
  void numbers(const Range& values, double low, double high, const char* what) {
    for (const double value : values) number(value, low, high, what);
  }

  [[nodiscard]] Result<> verdict(const std::string& name) const {
    if (sound()) return {};
    return fail("the model is not sound: " + wrong_ + "; train it again", name);
  }

 private:
  std::string wrong_;
};

}  // namespace posed::model_file
