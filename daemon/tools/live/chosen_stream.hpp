// ChosenStream: the stream of `posed top` and `posed demo` that the arrow keys chose: its figure,
// its latency over the last minute, and its alpha, which the keys change.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "daemon/tools/live/stream_figure.hpp"

namespace posed::v1 {
class Stats;
class StreamStats;
}  // namespace posed::v1

namespace posed::tools {

class ChosenStream {
 public:
  // `data` is the connection that receives the daemon's messages; it outlives the object.
  // `control`: where changes of alpha go; without an endpoint alpha cannot be changed.
  ChosenStream(const Connection& data, ClientOptions control)
      : data_(data), control_options_(std::move(control)) {}

  // Takes the stats of another second: the choice stays, or becomes the first stream if the chosen
  // one has gone.
  void take(const v1::Stats& stats);
  // Takes any other message of the daemon.
  void take(std::string_view topic, std::span<const std::byte> body);

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
