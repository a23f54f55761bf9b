// What `posed top` and `posed demo` show of one stream: its figure, its latency over the last
// minute and its alpha. Cold.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/picture/strip.hpp"

namespace posed::v1 {
class Stats;
class StreamStats;
}  // namespace posed::v1

namespace posed::tools {

// StreamFigure: the pose of one stream of a daemon as a small figure of text, for `posed top`.
class StreamFigure {
 public:
  explicit StreamFigure(std::string stream) : stream_(std::move(stream)) {}

  [[nodiscard]] const std::string& stream() const { return stream_; }
  // The stream's skeleton and its last pose; null and empty before the first pose.
  [[nodiscard]] const std::shared_ptr<const Skeleton>& skeleton() const { return skeleton_; }
  [[nodiscard]] const std::optional<Frame>& pose() const { return pose_; }

  // Takes a message of the daemon; those of other topics than skeleton/ and pose/ of the stream,
  // and what cannot be parsed, change nothing.
  void handle(std::string_view topic, std::span<const std::byte> body);

  // The last pose, seen in three-quarter view as it stood when the first pose came; empty before.
  // Call it at the rate of the screen: what the poses need as room grows at once and shrinks
  // slowly.
  [[nodiscard]] std::vector<std::string> lines(int columns, int rows);

 private:
  void take_skeleton(std::span<const std::byte> body);
  void take_pose(std::span<const std::byte> body);
  void fit_room();

  std::string stream_;
  std::uint32_t wire_id_ = 0;  // of the skeleton, as frames carry it
  std::shared_ptr<const Skeleton> skeleton_{};
  std::unique_ptr<picture::FigureShape> shape_{};
  std::optional<picture::Camera> camera_{};
  std::optional<Frame> pose_{};  // of skeleton_
  std::optional<picture::Figure> figure_{};
  std::optional<picture::StripLayout> room_{};
};

// A row of bars from a list of numbers, one character each, for a terminal. The tallest of the
// eight bars is the largest value. What is not above 0, or not finite, is the lowest bar.
[[nodiscard]] inline std::string sparkline(const std::vector<double>& values) {
  const auto height = [](double value) {
    return std::isfinite(value) ? std::max(value, 0.0) : 0.0;
  };
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, height(value));
  std::string text;
  for (const double value : values) {
    const double part = largest > 0.0 ? height(value) / largest : 0.0;
    text += "\xe2\x96";  // U+2581 to U+2588 in UTF-8
    text += static_cast<char>(0x81 + std::lround(part * 7.0));
  }
  return text;
}

// ChosenStream: the stream of `posed top` and `posed demo` that the arrow keys chose: its figure,
// its latency over the last minute, and its alpha, which the keys change.
class ChosenStream {
 public:
  // `data` is the connection that receives the daemon's messages; it outlives the object.
  // `control`: where changes of alpha go; without an endpoint alpha cannot be changed.
  ChosenStream(const Connection& data, ClientOptions control)
      : data_(data), control_options_(std::move(control)) {}

  // Takes the stats of another second: the choice stays, or becomes the first stream if the chosen
  // one has gone.
  void update(const v1::Stats& stats);
  // Takes any other message of the daemon.
  void handle(std::string_view topic, std::span<const std::byte> body);

  // Up and down choose another stream, left and right ask the daemon for another alpha; other keys
  // do nothing. A stream without alpha gives a note that says so.
  void obey(Key key, const v1::Stats& stats);
  // What the daemon answered, or why it cannot be asked; empty if there is nothing new.
  [[nodiscard]] std::optional<std::string> note();

  [[nodiscard]] std::string name() const { return figure_ ? figure_->stream() : std::string(); }
  // The panel: a line about latency, the figure, and a line about the keys; at most `rows` lines of
  // at most `columns` characters. The figure is left out where it would be too small.
  [[nodiscard]] std::vector<std::string> lines(const v1::Stats& stats, int columns, int rows);

 private:
  void subscribe(int option, const std::string& stream) const;
  void follow(const std::string& stream);
  void unfollow();
  void choose(const v1::Stats& stats, int step);
  void change_alpha(const v1::Stats& stats, double by);
  void ask(const std::string& stream, double alpha);
  void read_answer();
  [[nodiscard]] std::string latency_line(const std::string& stream, int columns) const;
  [[nodiscard]] const v1::StreamStats* stats_of(const v1::Stats& stats) const;

  const Connection& data_;
  ClientOptions control_options_;
  std::optional<Connection> control_;
  std::optional<StreamFigure> figure_;
  std::map<std::string, std::deque<double>> latency_us_;           // p99 of each second, by stream
  std::optional<double> asked_alpha_;                              // not yet in the stats
  std::optional<std::chrono::steady_clock::time_point> asked_at_;  // not answered yet
  std::optional<std::string> note_;
};

}  // namespace posed::tools
