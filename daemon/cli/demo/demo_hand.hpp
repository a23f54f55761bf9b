// The demo's hand, seen and asked as any client would: a signer's g, c and p, and now and then a
// string of labels that was not in the training data, performed over them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/cli/live/client.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::cli {

class DemoHand {
 public:
  // `control` is the daemon's endpoint.
  [[nodiscard]] static Result<DemoHand> open(const std::string& control);

  // A frame of the stream kDemoHandStream.
  void take(const v1::Frame& frame);
  // Asks for the string when its time has come and hears the answer; `seconds` since the start.
  [[nodiscard]] Result<> tend(double seconds);

  [[nodiscard]] std::string note() const;     // what it does now, one line
  [[nodiscard]] std::string summary() const;  // what it did; empty when no hand was seen

 private:
  explicit DemoHand(Connection connection) : connection_(std::move(connection)) {}

  Connection connection_;
  double next_play_s_ = 3.0;
  std::uint64_t frames_ = 0;
  v1::Frame last_;
  std::vector<std::string> performed_;  // the labels of the last string, as they came
  std::uint64_t performed_frames_ = 0;
};

inline constexpr const char* kDemoHandStream = "hand";

}  // namespace posed::cli
