// Ros2Output: sends streams to nodes of ROS 2 over DDS, without ROS: commands for robots, poses for
// viewers (Ros2Stream).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/output/output.hpp"
#include "daemon/output/ros2/dds.hpp"
#include "daemon/output/ros2/ros2_stream.hpp"

namespace posed::output {

class Ros2Output final : public Output {
 public:
  static Result<std::unique_ptr<Output>> open(const config::OutputConfig& config,
                                              std::unique_ptr<system::EventFd> wake);
  Ros2Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
             std::shared_ptr<DdsDomain> domain);

 private:
  [[nodiscard]] Result<> set_stream(std::size_t place, const LiveStream* stream) override;
  [[nodiscard]] bool take(std::size_t place, const Frame& frame, std::int64_t now_ns) override;
  void send(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t end_turn(std::int64_t now_ns) override;

  config::OutputConfig config_;
  std::shared_ptr<DdsDomain> domain_;
  std::vector<std::optional<Ros2Stream>> streams_;  // [place]
  std::int64_t look_ns_ = kNoTime_ns;               // when to count the readers next
};

}  // namespace posed::output
