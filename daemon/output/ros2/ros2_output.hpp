// Ros2Output: sends streams to nodes of ROS 2 over DDS, without ROS: commands for robots, poses for
// viewers (Ros2Stream).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/inbox.hpp"
#include "daemon/output/output.hpp"
#include "daemon/output/ros2/dds.hpp"
#include "daemon/output/send_outcome.hpp"
#include "models/motion/ros_frames.hpp"
#include "posed/ros2/messages.h"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

// One stream as topics of ROS 2. A robot's is a topic of commands, on which nothing goes out unless
// somebody has engaged the robot. Any other is for viewers: the joints' frames on `tf` and, where
// the skeleton has channels, their angles on `posed/STREAM/joint_states`.
//
// ROS's axes: x forward, y left, z up; metres, radians. One thread.
class Ros2Stream {
 public:
  // `stream` has a skeleton.
  Ros2Stream(const config::OutputConfig& config, std::shared_ptr<DdsDomain> domain,
             const LiveStream& stream);

  // Returns whether the frame is one to send; it replaces one that waits. Opens the topics when the
  // first frame tells whether the stream is a robot's.
  [[nodiscard]] Result<bool> take(const Frame& frame);
  // Sends the frame that waits, if one does, with the wall clock's time.
  [[nodiscard]] SendOutcome send();
  [[nodiscard]] std::size_t readers() const noexcept;

 private:
  using Stamp = builtin_interfaces_msg_dds__Time_;
  [[nodiscard]] Result<> open(bool robot);
  [[nodiscard]] SendOutcome send_command(Stamp stamp);
  [[nodiscard]] SendOutcome send_view(Stamp stamp);
  void fill_transforms(Stamp stamp);
  [[nodiscard]] sensor_msgs_msg_dds__JointState_ joint_state(Stamp stamp, bool velocities);

  std::shared_ptr<DdsDomain> domain_;
  std::string topic_;  // of a robot's commands
  bool trajectory_;
  std::shared_ptr<const Skeleton> skeleton_;
  std::string view_topic_;
  double period_s_;
  std::optional<bool> robot_;        // unknown before the first frame
  std::optional<DdsWriter> joints_;  // a robot's commands, or a viewer's angles
  std::optional<DdsWriter> frames_;  // for viewers

  Frame frame_{};
  bool waits_ = false;
  // What messages point to, so that a frame allocates nothing here.
  std::vector<std::string> joint_names_, frame_names_;
  std::string world_ = motion::kRosWorld;
  std::vector<char*> joint_texts_;
  std::vector<double> positions_, velocities_;  // [rotation channel]
  std::vector<std::size_t> driven_;  // the rotation channels that a controller may be told
  std::vector<char*> driven_texts_;
  std::vector<double> driven_positions_;
  std::vector<geometry_msgs_msg_dds__TransformStamped_> transforms_;  // [joint]
};

// The name as a part of a ROS topic, which has letters, digits and '_' and begins with no digit.
[[nodiscard]] std::string ros_word(const std::string& stream);

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
