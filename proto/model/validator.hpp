// Keeps the first error found in a model while it is read, so that the reading code needs no branch
// after each check.
#pragma once

#include <string>

#include "proto/frame/result.hpp"

namespace posed::model_file {

class Validator {
 public:
  void want(bool condition, const char* what) {
    if (!condition && wrong_.empty()) wrong_ = what;
  }

  [[nodiscard]] bool valid() const { return wrong_.empty(); }

  double number(double value, double low, double high, const char* what) {
    want(value >= low && value <= high, what);  // false for NaN
    return value;
  }

  template <typename Range>
  void numbers(const Range& values, double low, double high, const char* what) {
    for (const double value : values) number(value, low, high, what);
  }

  Result<> verdict(const std::string& name) const {
    if (valid()) return {};
    return fail("the model is not valid: " + wrong_ + "; train it again", name);
  }

 private:
  std::string wrong_;
};

}  // namespace posed::model_file
