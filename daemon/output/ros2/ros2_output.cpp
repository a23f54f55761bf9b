#include "daemon/output/ros2/ros2_output.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <ctime>
#include <utility>

#include <spdlog/spdlog.h>

namespace posed::output {
namespace {

// A controller moves to a point until its time, and refuses one whose time is over: two frames
// after it was sent, within limits that a network keeps and a hand does not feel.
constexpr double kMinReach_s = 0.01, kMaxReach_s = 0.1;
constexpr double kAssumedRate_hz = 100.0;  // where the stream does not know its own

builtin_interfaces_msg_dds__Time_ wall_clock() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return {.sec = static_cast<std::int32_t>(now.tv_sec),
          .nanosec = static_cast<std::uint32_t>(now.tv_nsec)};
}

// A joint that turns about one axis gives the name, another its name and the axis.
std::vector<std::string> names_of_angles(const Skeleton& skeleton) {
  constexpr std::array kAxes{"_x", "_y", "_z"};
  std::vector<std::string> names;
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    const auto all = channels_of(skeleton, channel.joint);
    const bool only = std::ranges::count(all, false, &Channel::translation) == 1;
    const std::string& joint = skeleton.joints[channel.joint].name;
    names.push_back(only ? joint : joint + kAxes[static_cast<std::size_t>(channel.axis)]);
  }
  return names;
}

dds_sequence_double sequence(std::vector<double>& values) noexcept {
  const auto size = static_cast<std::uint32_t>(values.size());
  return {._maximum = size, ._length = size, ._buffer = values.data(), ._release = false};
}

dds_sequence_string sequence(std::vector<char*>& texts) noexcept {
  const auto size = static_cast<std::uint32_t>(texts.size());
  return {._maximum = size, ._length = size, ._buffer = texts.data(), ._release = false};
}

void add(SendOutcome& sum, const SendOutcome& one) noexcept {
  sum.sent += one.sent;
  sum.dropped += one.dropped;
  sum.failed += one.failed;
}

}  // namespace

std::string ros_word(const std::string& stream) {
  std::string word = stream;
  std::ranges::replace(word, '-', '_');
  const bool letter = !word.empty() && word[0] >= 'a' && word[0] <= 'z';
  return letter ? word : "s" + word;
}

Ros2Stream::Ros2Stream(const config::OutputConfig& config, std::shared_ptr<DdsDomain> domain,
                       const LiveStream& stream)
    : domain_(std::move(domain)),
      topic_(config.topic),
      trajectory_(config.trajectory),
      skeleton_(stream.skeleton),
      view_topic_("posed/" + ros_word(stream.name) + "/joint_states"),
      period_s_(1.0 / (stream.rate_hz > 0.0 ? stream.rate_hz : kAssumedRate_hz)),
      joint_names_(names_of_angles(*stream.skeleton)),
      frame_names_(motion::ros_frame_names(stream.name, *stream.skeleton)) {
  if (topic_.empty()) {
    topic_ =
        "posed/" + ros_word(stream.name) + (trajectory_ ? "/joint_trajectory" : "/joint_commands");
  }
  for (std::string& name : joint_names_) joint_texts_.push_back(name.data());
  std::size_t angle = 0;
  for (const Channel& channel : skeleton_->channels) {
    if (channel.translation) continue;
    if (!channel.follows) driven_.push_back(angle);
    ++angle;
  }
  for (const std::size_t driven : driven_) driven_texts_.push_back(joint_texts_[driven]);
  driven_positions_.resize(driven_.size());
  positions_.resize(joint_names_.size());
  velocities_.resize(joint_names_.size());
  transforms_.resize(frame_names_.size());
  for (std::size_t j = 0; j < transforms_.size(); ++j) {
    const int parent = skeleton_->joints[j].parent;
    transforms_[j].header.frame_id = parent < 0 ? world_.data() : frame_names_[parent].data();
    transforms_[j].child_frame_id = frame_names_[j].data();
  }
}

Result<> Ros2Stream::open(bool robot) {
  robot_ = robot;
  joints_.reset();
  frames_.reset();
  if (robot) {
    const auto& message = trajectory_ ? kJointTrajectory : kJointState;
    auto commands = TRY(DdsWriter::open(domain_, message, topic_));
    joints_.emplace(std::move(commands));
    return {};
  }
  auto frames = TRY(DdsWriter::open(domain_, kTfMessage, "tf"));
  frames_.emplace(std::move(frames));
  if (!joint_names_.empty()) {
    auto angles = TRY(DdsWriter::open(domain_, kJointState, view_topic_));
    joints_.emplace(std::move(angles));
  }
  return {};
}

Result<bool> Ros2Stream::take(const Frame& frame) {
  const bool robot = frame.robot != RobotState::kNone;
  if (robot_ != robot) TRY(open(robot));
  waits_ = robot ? frame.robot != RobotState::kReleased && frame.angle_count == joint_names_.size()
                 : frame.quality != Quality::kStale && frame.joint_count == frame_names_.size();
  if (waits_) frame_ = frame;
  return waits_;
}

SendOutcome Ros2Stream::send() {
  if (!std::exchange(waits_, false)) return {};
  std::ranges::copy_n(frame_.angle_rad.begin(), std::ssize(positions_), positions_.begin());
  const Stamp stamp = wall_clock();
  return *robot_ ? send_command(stamp) : send_view(stamp);
}

sensor_msgs_msg_dds__JointState_ Ros2Stream::joint_state(Stamp stamp, bool velocities) {
  sensor_msgs_msg_dds__JointState_ message{};
  static char nowhere[] = "";
  message.header = {.stamp = stamp, .frame_id = nowhere};
  message.name = sequence(joint_texts_);
  message.position = sequence(positions_);
  if (velocities) message.velocity = sequence(velocities_);
  return message;
}

SendOutcome Ros2Stream::send_command(Stamp stamp) {
  std::ranges::copy_n(frame_.velocity_rad_s.begin(), std::ssize(velocities_), velocities_.begin());
  const auto state = joint_state(stamp, true);
  if (!trajectory_) return joints_->write(&state);
  // Without velocities: controllers refuse a trajectory that does not end at rest; and one with
  // joints that they do not drive.
  std::ranges::transform(driven_, driven_positions_.begin(),
                         [this](std::size_t angle) { return positions_[angle]; });
  const double reach_s = std::clamp(2.0 * period_s_, kMinReach_s, kMaxReach_s);
  trajectory_msgs_msg_dds__JointTrajectoryPoint_ point{};
  point.positions = sequence(driven_positions_);
  point.time_from_start.nanosec = static_cast<std::uint32_t>(nanoseconds(reach_s));
  trajectory_msgs_msg_dds__JointTrajectory_ message{};
  message.header = state.header;
  message.joint_names = sequence(driven_texts_);
  message.points = {._maximum = 1, ._length = 1, ._buffer = &point, ._release = false};
  return joints_->write(&message);
}

void Ros2Stream::fill_transforms(Stamp stamp) {
  const auto frames = motion::ros_frames(*skeleton_, frame_);
  for (std::size_t j = 0; j < transforms_.size(); ++j) {
    const auto& [at, turn] = frames[j];
    transforms_[j].header.stamp = stamp;
    transforms_[j].transform = {
        .translation = {.x = at.x(), .y = at.y(), .z = at.z()},
        .rotation = {.x = turn.x(), .y = turn.y(), .z = turn.z(), .w = turn.w()}};
  }
}

SendOutcome Ros2Stream::send_view(Stamp stamp) {
  SendOutcome outcome;
  if (frames_->readers() > 0) {
    fill_transforms(stamp);
    const auto size = static_cast<std::uint32_t>(transforms_.size());
    const tf2_msgs_msg_dds__TFMessage_ message{
        .transforms = {
            ._maximum = size, ._length = size, ._buffer = transforms_.data(), ._release = false}};
    add(outcome, frames_->write(&message));
  }
  if (joints_ && frame_.angle_count == positions_.size()) {
    const auto state = joint_state(stamp, false);
    add(outcome, joints_->write(&state));
  }
  return outcome;
}

std::size_t Ros2Stream::readers() const noexcept {
  return (joints_ ? joints_->readers() : 0) + (frames_ ? frames_->readers() : 0);
}

Result<std::unique_ptr<Output>> Ros2Output::open(const config::OutputConfig& config,
                                                 std::unique_ptr<system::EventFd> wake) {
  auto domain = TRY(DdsDomain::join(
      {.domain = config.domain, .interface = config.interface, .peers = config.peers}));
  if (config.interface != "lo") {
    spdlog::warn(
        "output {}: DDS on {} has neither keys nor rights: this computer and peers may read and"
        " send on every topic, and who reaches the network may forge their addresses",
        config.name, config.interface);
  }
  return std::make_unique<Ros2Output>(config, std::move(wake), std::move(domain));
}

Ros2Output::Ros2Output(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                       std::shared_ptr<DdsDomain> domain)
    : Output(config, std::move(wake)),
      config_(config),
      domain_(std::move(domain)),
      streams_(config.people()) {}

Result<> Ros2Output::set_stream(std::size_t place, const LiveStream* stream) {
  auto& there = streams_[place];
  there.reset();
  if (stream == nullptr) return {};
  if (stream->skeleton == nullptr) return fail("cannot be sent: it has values, but no joints");
  there.emplace(config_, domain_, *stream);
  return {};
}

bool Ros2Output::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  auto& stream = streams_[place];
  if (!stream) return false;
  const auto taken = stream->take(frame);
  if (taken) return *taken;
  notify({.text = "stream " + config_.bodies[place] + " " + taken.error().message});
  stream.reset();  // it is told once
  return false;
}

void Ros2Output::send(std::int64_t /*now_ns*/) {
  for (auto& stream : streams_) {
    if (stream) count(stream->send());
  }
}

std::int64_t Ros2Output::end_turn(std::int64_t now_ns) {
  if (look_ns_ != kNoTime_ns && now_ns < look_ns_) return look_ns_;
  std::size_t readers = 0;
  for (const auto& stream : streams_) readers += stream ? stream->readers() : 0;
  set_receivers(readers);
  look_ns_ = now_ns + kNanosPerSecond;
  return look_ns_;
}

}  // namespace posed::output
