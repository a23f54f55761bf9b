// Streams of a VirtualDaemon with stages, and commands with times and contents, drawn at random.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "models/gesture/model_file.hpp"
#include "models/style/model/style_model.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/virtual_daemon.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {

// What a stream shows.
enum class What : std::uint8_t { kBody, kHand };

inline void set_lag(pipeline::StageSettings& generate, int frames) {
  generate.parameters["lag_frames"] = std::int64_t{frames};
}

inline VirtualStream random_body(const std::string& name, double length_s, Dice& dice) {
  VirtualStream body = walking_stream(name, length_s, 1);
  body.settings.publish_raw = dice.below(2) == 0;
  if (dice.below(2) == 0) {
    body.settings.stages.pop_back();
    body.model_files.pop_back();
  } else {
    set_lag(body.settings.stages[1], dice.below(4));
  }
  return body;
}

inline VirtualStream random_hand(const std::string& name, double length_s, Dice& dice) {
  VirtualStream hand = glove_stream(name, length_s);
  hand.settings.publish_raw = dice.below(2) == 0;
  set_lag(hand.settings.stages[0], dice.below(4));
  if (dice.below(4) == 0) {
    hand.settings.stages.pop_back();
    hand.model_files.pop_back();
  }
  if (dice.below(2) == 0) hand.calibration = glove_calibration(dice.below(3));
  return hand;
}

// A command that fits the stream.
inline VirtualCommand random_command(std::uint32_t stream, What what, double length_s, Dice& dice) {
  static const std::string one = style::serialize_model(toy_model(1));
  static const std::string two = style::serialize_model(toy_model(2));
  static const std::string gestures = gesture::serialize_model(toy_gesture_model());
  using Kind = VirtualCommand::Kind;
  VirtualCommand command{.at_s = dice.within(0.0, length_s), .stream = stream};
  if (what == What::kBody) {
    command.kind = dice.below(2) == 0 ? Kind::kAlpha : Kind::kModel;
    command.alpha = static_cast<float>(dice.within(-2.0, 2.0));
    command.bytes = dice.below(2) == 0 ? one : two;
    return command;
  }
  constexpr std::array kKinds{Kind::kPlay, Kind::kPlay, Kind::kStopPlaying, Kind::kModel,
                              Kind::kCalibrate};
  command.kind = kKinds[static_cast<std::size_t>(dice.below(kKinds.size()))];
  command.bytes = command.kind == Kind::kModel ? gestures : glove_calibration(dice.below(4));
  command.labels = dice.below(2) == 0 ? "g 1 c" : "4";
  command.loop = dice.below(4) == 0;
  return command;
}

}  // namespace posed::test
