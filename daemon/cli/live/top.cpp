#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/json.hpp"
#include "daemon/cli/live/client.hpp"
#include "daemon/cli/live/clock_time.hpp"
#include "daemon/cli/live/live_view.hpp"
#include "daemon/cli/paint.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::cli {
namespace {

constexpr std::size_t kNotesKept = 50;

struct TopOptions {
  ClientOptions client;
  int count = 0;
  double timeout_s = 0.0;
  bool json = false;
};

// Runs until the user ends it; an error says why the daemon cannot be shown.
class Top {
 public:
  Top(const TopOptions& options, Connection connection)
      : options_(options),
        connection_(std::move(connection)),
        watch_(connection_, options.timeout_s) {}

  Result<> run() {
    std::optional<LiveScreen> screen;
    if (!options_.json) screen.emplace();
    const bool drawn = screen && screen->is_terminal();
    watch_.print(!drawn);
    if (drawn) show(*screen);
    while (!Interrupt::came() && !(screen && screen->quit_pressed())) {
      if (auto refused = connection_.refusal()) return std::unexpected(*refused);
      if (auto given_up = watch_.report()) return std::unexpected(*given_up);
      if (!connection_.wait(kLookAround)) {
        if (drawn && (watch_.silence() || was_silent_)) show(*screen);
        continue;
      }
      if (!take()) continue;
      const bool shown = screen ? show(*screen) : print_json(stats_);
      if (!shown) return {};  // the reader of stdout has gone
      if (++shown_ == options_.count) return {};
    }
    if (options_.count == 0) return {};
    return fail(fmt::format("interrupted after {} of {} updates", shown_, options_.count));
  }

 private:
  // Receives one message; returns true if it brought new stats.
  bool take() {
    net::Message topic, body;
    if (!topic.receive(connection_.socket()) || !topic.more()) return false;
    if (!body.receive(connection_.socket(), 0)) return false;
    watch_.heard();
    const auto size = static_cast<int>(body.bytes().size());
    if (topic.text() == "stats") return stats_.ParseFromArray(body.bytes().data(), size);
    v1::Event event;
    if (!event.ParseFromArray(body.bytes().data(), size)) return false;
    notes_.push_back(clock_time().substr(0, 8) + " " + clean_name(event.stream()) + ": " +
                     clean(event.text()));
    if (notes_.size() > kNotesKept) notes_.pop_front();
    return false;
  }

  // Returns false if the output can no longer be seen.
  bool show(LiveScreen& screen) {
    LiveViewOptions view{.title = "posed " + options_.client.endpoint};
    screen.measure(view);
    view.notes.assign(notes_.begin(), notes_.end());
    view.silence = watch_.silence().value_or("");
    was_silent_ = !view.silence.empty();
    if (!screen.is_terminal()) notes_.clear();  // plain lines: print each note once
    if (stats_.stream_size() > 0 || stats_.time_ns() != 0) {
      screen.draw(live_view(stats_, view));
    } else if (screen.is_terminal()) {
      std::vector<std::string> lines{"waiting for " + options_.client.endpoint + " (q quits)"};
      if (was_silent_) lines.push_back(paint(view.colour, kRed, cut(view.silence, view.width)));
      screen.draw(lines);
    }
    return std::ferror(stdout) == 0;
  }

  TopOptions options_;
  Connection connection_;
  SilenceWatch watch_;
  v1::Stats stats_;
  std::deque<std::string> notes_;
  int shown_ = 0;
  bool was_silent_ = false;  // when last drawn
};

Result<> top(const TopOptions& options) {
  const Interrupt interrupt;
  auto connection = Connection::open(options.client, ZMQ_SUB);
  if (!connection) return std::unexpected(connection.error());
  for (const char* topic : {"stats", "event/"}) {
    if (auto set = net::set_option(connection->socket(), ZMQ_SUBSCRIBE, topic); !set) {
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
  add_timeout_option(*command, options->timeout_s);
  command->add_flag("--json", options->json, "One proto3 JSON object (posed.v1.Stats) a line");
  command->footer(std::string(R"(Examples:
  posed top
  posed top --connect tcp://127.0.0.1:5570 --count 1 | cat
  posed top --count 1 --timeout 5 --json      # a health check: exit code 1 when nothing answers
q or Ctrl-C quits. When stdout is no terminal it prints plain lines. A daemon that falls silent is
shown in red with the time since then, and values that may be outdated are hidden.
)") + kColumnsHelp);
  command->callback([options, &exit_code] {
    if (auto done = top(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
