// A change of weights or mask in the device log is the change that was made.
#include "daemon/record/decision_code.hpp"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "models/style/live/style_filter.hpp"
#include "models/style/live/style_type.hpp"
#include "posed/v1/log.pb.h"

namespace posed::record {
namespace {

pipeline::Decision decision(std::size_t command, const StageCommand& payload) {
  return {.kind = pipeline::Decision::Kind::kChange,
          .stream = 1,
          .item = 7,
          .change = {.kind = pipeline::StageChange::Kind::kCommand,
                     .index = static_cast<std::uint8_t>(command),
                     .type = &style::style_type()},
          .command = payload};
}

}  // namespace

TEST_CASE("weights and masks come back from the log bit for bit") {
  const std::vector<std::string> styles{"feminine", "active", "elderly"};
  const auto shares = style::shares_of("feminine=0.1,elderly=0.7", styles).value();
  const auto row = row_of(decision(style::StyleFilter::kWeights, StageCommand::of(shares)));
  CHECK(row.stage == "style");
  CHECK(row.name == "weights");
  const auto read = decision_of(row, "a.plog").value();
  CHECK(read.change.kind == pipeline::StageChange::Kind::kCommand);
  CHECK(read.change.index == style::StyleFilter::kWeights);
  CHECK(read.command.as<style::Shares>().of == shares.of);
  CHECK(read.command.as<style::Shares>().count == 3);
  const auto mask = style::mask_of("arms=0.3").value();
  const auto mask_row = row_of(decision(style::StyleFilter::kMask, StageCommand::of(mask)));
  CHECK(mask_row.name == "mask");
  CHECK(decision_of(mask_row, "a.plog")->command.as<style::Mask>() == mask);
}

TEST_CASE("weights and masks that no pipeline can have written are refused") {
  const auto refused = [](const char* name, const std::vector<double>& numbers) {
    v1::DecisionValue value;
    value.mutable_weights();
    for (const double number : numbers) value.mutable_weights()->add_weight(number);
    auto row =
        row_of(decision(style::StyleFilter::kWeights, StageCommand::of(style::first_alone(1))));
    row.name = name;
    row.value = value.SerializeAsString();
    return !decision_of(row, "a.plog").has_value();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(refused("weights", {0.5, 0.5}));
  CHECK(refused("weights", {}));
  CHECK(refused("weights", {0.5, 0.4}));
  CHECK(refused("weights", {1.5, -0.5}));
  CHECK(refused("weights", {nan, 1.0}));
  CHECK(refused("weights", std::vector<double>(17, 1.0 / 17.0)));
  CHECK_FALSE(refused("mask", {1, 1, 0, 0.5, 1, 1}));
  CHECK(refused("mask", {1, 1}));
  CHECK(refused("mask", {1, 1, 0, 2, 1, 1}));
}

}  // namespace posed::record
