// What `posed monitor` prints of each kind of message: one line, for people.
#pragma once

#include <string>

namespace posed::v1 {
class Event;
class Frame;
class Sample;
class Skeleton;
class Stats;
}  // namespace posed::v1

namespace posed::cli {

// Without the time of day that stands before each line. Words of strangers are cleaned.
[[nodiscard]] std::string monitor_line(const v1::Frame& frame);
[[nodiscard]] std::string monitor_line(const v1::Sample& sample);
[[nodiscard]] std::string monitor_line(const v1::Event& event);
[[nodiscard]] std::string monitor_line(const v1::Skeleton& skeleton);
[[nodiscard]] std::string monitor_line(const v1::Stats& stats);

// "a replay of take1.plog, 1 x its pace; its times are the recording's"
[[nodiscard]] std::string replay_words(const v1::Stats& stats);

// "performs g" of a pose made from labels, "recognised g 83 %" of one that a hand made; empty
// without a label. `Labelled` is a Frame or a StreamStats.
template <typename Labelled>
[[nodiscard]] std::string label_words(const Labelled& labelled);

}  // namespace posed::cli
