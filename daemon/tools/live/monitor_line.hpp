// The lines of `posed monitor`, and the time of day beside an event. Cold.
#pragma once

#include <chrono>
#include <ctime>
#include <string>

#include <spdlog/fmt/fmt.h>

namespace posed::v1 {
class Event;
class Frame;
class Sample;
class Skeleton;
class Stats;
}  // namespace posed::v1

namespace posed::tools {

// "17:04:09.250", in this machine's time zone.
inline std::string clock_time() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t whole = std::chrono::system_clock::to_time_t(now);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm local{};
  localtime_r(&whole, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", local.tm_hour, local.tm_min, local.tm_sec, ms);
}

// A line for people of each kind of message, without the time of day at the start of the line.
// Control characters are removed from untrusted text.
[[nodiscard]] std::string monitor_line(const v1::Frame& frame);
[[nodiscard]] std::string monitor_line(const v1::Sample& sample);
[[nodiscard]] std::string monitor_line(const v1::Event& event);
[[nodiscard]] std::string monitor_line(const v1::Skeleton& skeleton);
[[nodiscard]] std::string monitor_line(const v1::Stats& stats);

// "a replay of take1.plog, 1 x its pace; its times are the recording's"
[[nodiscard]] std::string replay_words(const v1::Stats& stats);

// "performs g" for a pose made from labels, "recognised g 83 %" for a measured one; empty without a
// label. `Labelled` is a Frame or a StreamStats.
template <typename Labelled>
[[nodiscard]] std::string label_words(const Labelled& labelled);

}  // namespace posed::tools
