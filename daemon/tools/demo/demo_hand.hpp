// The hand of the demo, watched and controlled as by any client: a signer performs g, c and p, and
// from time to time the daemon performs labels in an order that was not in the training data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/tools/command/client.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::tools {

class DemoHand {
 public:
  // `control` is the daemon's control endpoint.
  [[nodiscard]] static Result<DemoHand> open(const std::string& control);

  // Call with each frame of the stream kDemoHandStream.
  void take(const v1::Frame& frame);
  // Sends the labels when it is time, and reads the reply; `seconds` since the start.
  [[nodiscard]] Result<> tend(double seconds);

  [[nodiscard]] std::string note() const;     // what the hand does now, one line
  [[nodiscard]] std::string summary() const;  // what it has done; empty if no hand was seen

 private:
  explicit DemoHand(Connection connection) : connection_(std::move(connection)) {}

  Connection connection_;
  double next_play_s_ = 3.0;
  std::uint64_t frames_ = 0;
  v1::Frame last_;
  std::vector<std::string> performed_;  // the labels of the last performance, as they came
  std::uint64_t performed_frames_ = 0;
};

inline constexpr const char* kDemoHandStream = "hand";

}  // namespace posed::tools
