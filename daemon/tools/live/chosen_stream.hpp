// What `posed top` and `posed demo` show of one stream: its figure, its latency over the last
// minute and its alpha. Cold; one thread.
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

// StreamFigure draws the newest pose of one stream as a small figure of text.
class StreamFigure {
 public:
  explicit StreamFigure(std::string stream) : stream_(std::move(stream)) {}

  [[nodiscard]] const std::string& stream() const { return stream_; }
  // The stream's skeleton and its last pose; null and empty before the first pose.
  [[nodiscard]] const std::shared_ptr<const Skeleton>& skeleton() const { return skeleton_; }
  [[nodiscard]] const std::optional<Frame>& pose() const { return pose_; }

  // Takes a message of the daemon. One that cannot be parsed, or whose topic is neither
  // skeleton/STREAM nor pose/STREAM, changes nothing.
  void handle(std::string_view topic, std::span<const std::byte> body);

  // Draws the last pose, in a three-quarter view by the heading of the first; empty before that.
  // Call it at the rate of the screen: each call widens the view at once to hold the pose, or
  // narrows it a little.
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

// Returns a bar for each number, one character each, for a terminal. The largest number gets the
// tallest of eight bars. A number that is not above 0, or not finite, gets the lowest.
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

// ChosenStream: the stream that the arrow keys chose, with its figure, its latency over the last
// minute, and its alpha, which the keys change.
class ChosenStream {
 public:
  // `data` receives the daemon's messages and outlives the object. Changes of alpha go to
  // `control`; if that has no endpoint, alpha cannot be changed.
  ChosenStream(Connection& data, ClientOptions control)
      : data_(data), control_options_(std::move(control)) {}

  // Takes the stats of the next second. If the chosen stream has gone, the first one is chosen.
  void update(const v1::Stats& stats);
  // Takes any other message of the daemon.
  void handle(std::string_view topic, std::span<const std::byte> body);

  // Up and down choose another stream, left and right ask the daemon for another alpha; other keys
  // do nothing. If alpha cannot be changed, note() says why.
  void obey(Key key, const v1::Stats& stats);
  // Reads the daemon's answers. Returns why alpha stays as it is, once; empty: nothing new.
  [[nodiscard]] std::optional<std::string> note();

  [[nodiscard]] std::string name() const { return figure_ ? figure_->stream() : std::string(); }
  // The panel: a line about latency, the figure, and a line about the keys; at most `rows` lines of
  // at most `columns` characters. The figure is left out where it would be too small.
  [[nodiscard]] std::vector<std::string> lines(const v1::Stats& stats, int columns, int rows);

 private:
  void subscribe(const std::string& stream, bool wanted);
  void follow(const std::string& stream);
  void unfollow();
  void choose(const v1::Stats& stats, int step);
  void change_alpha(const v1::Stats& stats, double by);
  void ask(const std::string& stream, double alpha);
  void read_answer();
  [[nodiscard]] std::string latency_line(const std::string& stream, int columns) const;
  [[nodiscard]] const v1::StreamStats* stats_of(const v1::Stats& stats) const;

  Connection& data_;
  ClientOptions control_options_;
  std::optional<Connection> control_;
  std::optional<StreamFigure> figure_;
  std::map<std::string, std::deque<double>> latency_us_;           // p99 of each second, by stream
  std::optional<double> asked_alpha_;                              // not yet in the stats
  std::optional<std::chrono::steady_clock::time_point> asked_at_;  // not answered yet
  std::optional<std::string> note_;
};

}  // namespace posed::tools
