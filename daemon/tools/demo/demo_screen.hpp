// The screen of `posed demo`: the live view of its daemon, with a figure and keys as in `posed
// top`, and what the demo itself sees.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/tools/demo/demo_hand.hpp"
#include "daemon/tools/demo/demo_watcher.hpp"
#include "daemon/tools/live/chosen_stream.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::assembly {
class Daemon;
}

namespace posed::tools {

class DemoScreen {
 public:
  // `daemon` and `connection`, which receives its messages, outlive the screen. `url`: the page's
  // address, on the first line; empty: there is no page.
  DemoScreen(const assembly::Daemon& daemon, const Connection& connection, const std::string& url);

  // Takes a message of the daemon.
  void take(std::string_view topic, std::span<const std::byte> body) { chosen_.take(topic, body); }
  // Obeys the keys that wait; returns whether the user wants to end.
  [[nodiscard]] bool quits();
  // Draws, if it is time.
  void show(Watcher& watcher, const DemoHand& hand);

 private:
  using SteadyClock = std::chrono::steady_clock;
  void look(Watcher& watcher, const DemoHand& hand);

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
