// One human-readable line for each kind of message, as printed by `posed monitor`.
#pragma once

#include <string>

namespace posed::v1 {
class Event;
class Frame;
class Sample;
class Skeleton;
class Stats;
}  // namespace posed::v1

namespace posed::tools {

// Without the time of day at the start of the line. Control characters are removed from untrusted
// text.
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
