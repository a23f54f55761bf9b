#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>

#include <CLI/CLI.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/client.hpp"
#include "daemon/cli/clock_time.hpp"
#include "daemon/cli/json.hpp"
#include "daemon/cli/live_view.hpp"
#include "daemon/config/words.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::cli {
namespace {

constexpr std::size_t kNotesKept = 50;

struct TopOptions {
  ClientOptions client;
  int count = 0;
  bool json = false;
};

// Runs until someone wants to go; an error is why the daemon cannot be shown.
class Top {
 public:
  Top(const TopOptions& options, Connection connection)
      : options_(options), connection_(std::move(connection)) {}

  Result<> run() {
    std::optional<LiveScreen> screen;
    if (!options_.json) screen.emplace();
    if (screen) show(*screen);
    while (!Interrupt::came() && !(screen && screen->quit_pressed())) {
      if (auto refused = connection_.refusal()) return std::unexpected(*refused);
      if (!connection_.wait(kLookAround)) continue;
      if (take() && (screen ? show(*screen) : print_json(stats_)) && ++shown_ == options_.count) {
        break;
      }
    }
    return {};
  }

 private:
  // One message; true when it brought new stats.
  bool take() {
    control::Message topic, body;
    if (!topic.receive(connection_.socket()) || !topic.more()) return false;
    if (!body.receive(connection_.socket(), 0)) return false;
    const auto size = static_cast<int>(body.bytes().size());
    if (topic.text() == "stats") return stats_.ParseFromArray(body.bytes().data(), size);
    v1::Event event;
    if (!event.ParseFromArray(body.bytes().data(), size)) return false;
    notes_.push_back(clock_time().substr(0, 8) + " " + event.stream() + ": " +
                     config::without_controls(event.text()));
    if (notes_.size() > kNotesKept) notes_.pop_front();
    return false;
  }

  bool show(LiveScreen& screen) {
    LiveViewOptions view{.title = "posed " + options_.client.endpoint};
    screen.measure(view);
    view.notes.assign(notes_.begin(), notes_.end());
    if (!screen.is_terminal()) notes_.clear();  // plain lines: each is told once
    if (stats_.time_ns() != 0) {
      screen.draw(live_view(stats_, view));
    } else if (screen.is_terminal()) {
      screen.draw({"waiting for " + options_.client.endpoint + " (q quits)"});
    }
    return true;
  }

  TopOptions options_;
  Connection connection_;
  v1::Stats stats_;
  std::deque<std::string> notes_;
  int shown_ = 0;
};

Result<> top(const TopOptions& options) {
  const Interrupt interrupt;
  auto connection = Connection::open(options.client, ZMQ_SUB);
  if (!connection) return std::unexpected(connection.error());
  for (const char* topic : {"stats", "event/"}) {
    if (auto set = control::set_option(connection->socket(), ZMQ_SUBSCRIBE, topic); !set) {
      return set;
    }
  }
  return Top(options, std::move(*connection)).run();
}

}  // namespace

void add_top(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("top", "Watch a running daemon: rates, stage times, drops");
  auto options = std::make_shared<TopOptions>();
  add_client_options(*command, options->client, "tcp://127.0.0.1:5570");
  command->add_option("--count", options->count, "End after so many updates (one a second)")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command->add_flag("--json", options->json, "One proto3 JSON object (posed.v1.Stats) a line");
  command->footer(R"(Examples:
  posed top
  posed top --connect tcp://127.0.0.1:5570 --count 1 | cat
q or Ctrl-C quits. When stdout is no terminal it prints plain lines.)");
  command->callback([options, &exit_code] {
    if (auto done = top(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
