// The demo as a client of its own daemon: what it counts, its hand, and its screen. Cold.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/live/chosen_stream.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "models/motion/turn_sum.hpp"
#include "posed/v1/control.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::assembly {
class Daemon;
}

namespace posed::tools {

inline constexpr const char* kDemoHandStream = "hand";

inline constexpr const char* kDemoWalkerStream = "walker";

// What the demo asks of its daemon, as any client would.
class DemoRequests {
 public:
  // `control` is the daemon's control endpoint.
  static Result<DemoRequests> open(const std::string& control);

  Result<> send(const v1::ControlRequest& request);
  // Reads the reply that waits. The error is a refusal; `what` names the request in it.
  Result<> read_reply(std::string_view what);

 private:
  explicit DemoRequests(Connection connection) : connection_(std::move(connection)) {}
  Connection connection_;
};

// Switches the walker's style off and on by itself, so that a visitor sees what posed does. It ends
// for good when somebody else has changed alpha.
class DemoStyle {
 public:
  static Result<DemoStyle> open(const std::string& control);

  // `seconds` since the start; call it often. `stats` is asked when a change is due.
  Result<> tend(double seconds, const std::function<v1::Stats()>& stats);

  [[nodiscard]] std::string note() const;  // what the walker does now, one line

 private:
  explicit DemoStyle(DemoRequests requests) : requests_(std::move(requests)) {}

  DemoRequests requests_;
  double next_s_ = 8.0;
  float asked_ = 1.0F;  // alpha
  bool left_alone_ = false;
};

// The hand of the demo, watched and controlled as by any client: a signer performs g, c and p, and
// from time to time the daemon performs labels in an order that was not in the training data.
class DemoHand {
 public:
  // `control` is the daemon's control endpoint.
  static Result<DemoHand> open(const std::string& control);

  // Call with each frame of the stream kDemoHandStream.
  void handle(const v1::Frame& frame);
  // Sends the labels when it is time, and reads the reply; `seconds` since the start.
  Result<> tend(double seconds);

  [[nodiscard]] std::string note() const;     // what the hand does now, one line
  [[nodiscard]] std::string summary() const;  // what it has done; empty if no hand was seen

 private:
  explicit DemoHand(DemoRequests requests) : requests_(std::move(requests)) {}

  DemoRequests requests_;
  double next_play_s_ = 3.0;
  std::uint64_t frames_ = 0;
  v1::Frame last_;
  std::vector<std::string> performed_;  // the labels of the last performance, as they came
  std::uint64_t performed_frames_ = 0;
};

// Receives raw and styled frames, and compares those of the same instant.
class Watcher {
 public:
  explicit Watcher(DemoHand& hand) : hand_(hand) {}

  void handle(const std::string& topic, const void* body, std::size_t size) {
    if (!frame_.ParseFromArray(body, static_cast<int>(size))) return;
    if (frame_.stream() == kDemoHandStream) return hand_.handle(frame_);
    if (topic.ends_with(kRawSuffix)) {
      raw_[frame_.sequence()].assign(frame_.rotation_xyzw().begin(), frame_.rotation_xyzw().end());
      while (raw_.size() > kKept) raw_.erase(raw_.begin());
      return;
    }
    ++styled_;
    gaps_ += last_ != 0 && frame_.sequence() > last_ ? frame_.sequence() - last_ - 1 : 0;
    last_ = frame_.sequence();
    compare();
  }

  [[nodiscard]] std::uint64_t styled() const { return styled_; }
  [[nodiscard]] std::uint64_t gaps() const { return gaps_; }
  // The rms difference from the raw pose in degrees (motion::TurnSum): over all frames, and over
  // those since the last call.
  [[nodiscard]] double change_deg() const { return all_.rms_rad() * kDegrees; }
  [[nodiscard]] double change_lately_deg() {
    const double change = lately_.rms_rad() * kDegrees;
    lately_ = {};
    return change;
  }

 private:
  static Quatf rotation_at(const float* xyzw) { return {xyzw[0], xyzw[1], xyzw[2], xyzw[3]}; }

  static constexpr std::size_t kKept = 64;

  void compare() {
    const auto found = raw_.find(frame_.sequence());
    if (found == raw_.end()) return;
    const std::vector<float>& raw = found->second;
    if (static_cast<int>(raw.size()) != frame_.rotation_xyzw_size() || raw.empty()) return;
    for (std::size_t j = 0; j + 3 < raw.size(); j += 4) {
      const Quatf before = rotation_at(&raw[j]);
      const Quatf after = rotation_at(frame_.rotation_xyzw().data() + j);
      all_.add(j / 4, before, after);
      lately_.add(j / 4, before, after);
    }
    all_.end_frame();
    lately_.end_frame();
  }

  DemoHand& hand_;
  v1::Frame frame_;
  std::map<std::uint64_t, std::vector<float>> raw_;
  std::uint64_t styled_ = 0, gaps_ = 0, last_ = 0;
  motion::TurnSum all_, lately_;
};

// The screen of `posed demo`: the live view of its daemon, with a figure and keys as in `posed
// top`, and what the demo itself sees.
class DemoScreen {
 public:
  // `daemon` and `connection`, which receives its messages, outlive the screen. `url`: the page's
  // address, on the first line; empty: there is no page.
  DemoScreen(const assembly::Daemon& daemon, Connection& connection, const std::string& url);

  // Takes a message of the daemon.
  void handle(std::string_view topic, std::span<const std::byte> body) {
    chosen_.handle(topic, body);
  }
  // Obeys the keys that wait; returns whether the user wants to end.
  [[nodiscard]] bool quits();
  // Draws, if it is time.
  void show(Watcher& watcher, const DemoStyle& style, const DemoHand& hand);

 private:
  using SteadyClock = std::chrono::steady_clock;
  void look(Watcher& watcher, const DemoStyle& style, const DemoHand& hand);

  const assembly::Daemon& daemon_;
  std::string first_line_;  // empty: none
  ChosenStream chosen_;
  LiveScreen screen_;
  LiveViewOptions view_;
  v1::Stats stats_;
  std::optional<std::string> answer_;  // to the last key that was not obeyed
  std::optional<SteadyClock::time_point> drawn_, looked_, taken_;
};

}  // namespace posed::tools
