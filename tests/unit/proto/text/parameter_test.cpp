#include "proto/text/parameter.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <limits>

#include "proto/frame/degree.hpp"

namespace posed {
namespace {

const std::array<ParameterSpec, 4> kTable{{
    {.name = "gain", .default_value = 1.0, .help = "", .min = -2.0, .max = 2.0},
    {.name = "noise_rad",
     .default_value = 0.0,
     .help = "",
     .min = 0.0,
     .max = 90.0 * kDegree,
     .display_name = "noise_deg",
     .display_scale = 1.0 / kDegree},
    {.name = "count", .default_value = std::int64_t{3}, .help = "", .min = 0.0, .max = 9.0},
    {.name = "on", .default_value = false, .help = ""},
}};

std::string parameter_refusal(const ParameterSpec& spec, const ParameterValue& value) {
  const auto checked = from_display(spec, value, spec.shown_name());
  return checked ? std::string() : checked.error().message;
}

TEST_CASE("a value is checked against its type and its range, in the units of people") {
  CHECK(from_display(kTable[0], std::int64_t{2}, "gain").value() == ParameterValue(2.0));
  CHECK(parameter_refusal(kTable[0], 2.5) ==
        "gain = 2.5 is out of range: it takes a number from -2 to 2");
  CHECK(parameter_refusal(kTable[0], std::numeric_limits<double>::quiet_NaN())
            .contains("out of range"));
  CHECK(parameter_refusal(kTable[0], true) == "gain must be a number, not true or false");
  CHECK(std::get<double>(from_display(kTable[1], 90.0, "").value()) == Approx(1.5707963268));
  CHECK(parameter_refusal(kTable[1], 91.0) ==
        "noise_deg = 91 is out of range: it takes a number of degrees from 0 to 90");
  CHECK(parameter_refusal(kTable[2], 0.5) == "count must be an integer, not a number");
  CHECK(parameter_refusal(kTable[2], std::int64_t{10}).contains("an integer from 0 to 9"));
  CHECK(parameter_refusal(kTable[3], std::string("on")) == "on must be true or false, not text");
}

TEST_CASE("a complete table has every default, in our units, and nothing unknown") {
  const auto complete = complete_parameters(kTable, {{"noise_rad", 0.5}});
  REQUIRE(complete);
  CHECK(complete->size() == kTable.size());
  CHECK(parameter<double>(*complete, "noise_rad") == 0.5);
  CHECK(parameter<std::int64_t>(*complete, "count") == 3);
  CHECK_FALSE(complete_parameters(kTable, {{"noise_deg", 1.0}}));
  CHECK_FALSE(complete_parameters(kTable, {{"noise_rad", 2.0}}));
  CHECK_FALSE(complete_parameters(kTable, {{"on", 1.0}}));
  CHECK(find_parameter(kTable, "noise_deg") == &kTable[1]);
  CHECK(find_parameter(kTable, "") == nullptr);
}

}  // namespace
}  // namespace posed
