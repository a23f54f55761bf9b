// The tables of parameters: what a row says of a live parameter is what the stage does.
#include <catch2/catch.hpp>

#include <string>
#include <variant>
#include <vector>

#include "models/motion/synthetic_walker.hpp"
#include "models/stages/registry.hpp"

namespace posed {
namespace {

// Numbers that a live parameter can have: each flag, each word, both ends of a range.
std::vector<double> numbers_for(const ParameterSpec& spec) {
  if (std::holds_alternative<bool>(spec.default_value)) return {1.0, 0.0};
  if (spec.words.empty()) return {spec.min, spec.max};
  std::vector<double> numbers;
  for (std::size_t i = 0; i < spec.words.size(); ++i) numbers.push_back(static_cast<double>(i));
  return numbers;
}

}  // namespace

TEST_CASE("every live number of a stage is set and read back, and begins with its default",
          "[stages]") {
  const clip::Clip walk = motion::make_walker({.seconds = 1.0}).value();
  int checked = 0;
  for (const StageType* const type : stage_types()) {
    for (std::size_t i = 0; i < type->parameters.size(); ++i) {
      const ParameterSpec& spec = type->parameters[i];
      if (!spec.live || !has_number(spec)) continue;
      INFO(std::string(type->name) + "." + std::string(spec.name));
      const auto stage = type->make({.skeleton = walk.skeleton,
                                     .rate_hz = walk.frame_rate_hz,
                                     .parameters = *complete_parameters(type->parameters, {})},
                                    nullptr);
      REQUIRE(stage);
      CHECK((*stage)->state(i).target == number_of(spec, spec.default_value));
      for (const double number : numbers_for(spec)) {
        REQUIRE(takes_number(spec, number));
        (*stage)->set(i, number);
        CHECK((*stage)->state(i).target == number);
      }
      ++checked;
    }
  }
  CHECK(checked >= 7);
}

}  // namespace posed
