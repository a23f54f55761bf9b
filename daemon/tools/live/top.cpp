#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/live/chosen_stream.hpp"
#include "daemon/tools/live/line_file.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "daemon/tools/live/monitor_line.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr std::size_t kNotesKept = 50;

constexpr std::chrono::milliseconds kFigurePeriod{100};

struct TopOptions {
  ClientOptions client;
  std::string control;  // endpoint, or empty; the keys are those of `client`
  int count = 0;
  double timeout_s = 0.0;
  bool json = false;
  std::string record;  // a file; empty: none
  bool overwrite = false;
};

// Runs until the user ends it; an error says why the daemon cannot be shown.
class Top {
 public:
  Top(const TopOptions& options, Connection connection)
      : options_(options),
        connection_(std::move(connection)),
        watch_(connection_, options.timeout_s),
        chosen_(connection_, {.endpoint = options.control,
                              .key = options.client.key,
                              .server_key = options.client.server_key}) {
    if (!options.record.empty()) record_.emplace(options.record, options.overwrite);
  }

  Result<> run() {
    std::optional<LiveScreen> screen;
    if (!options_.json) screen.emplace();
    const bool drawn = screen && screen->is_terminal();
    watch_.print(!drawn);
    if (drawn) show(*screen);
    while (!Interrupt::came() && !(drawn && quits(*screen))) {
      if (auto refused = connection_.refusal()) return std::unexpected(*refused);
      if (auto given_up = watch_.report()) return std::unexpected(*given_up);
      const bool came = connection_.wait(kLookAround);
      const bool new_stats = came && receive(drawn);
      if (drawn && !new_stats && is_due()) show(*screen);
      if (!new_stats) continue;
      if (record_) {
        TRY(record_->add(to_json(stats_)));
      }
      const bool shown = screen ? show(*screen) : print_json(stats_);
      if (!shown) return {};  // the reader of stdout has gone
      if (++shown_ == options_.count) return {};
    }
    if (options_.count == 0) return {};
    return fail(fmt::format("interrupted after {} of {} updates", shown_, options_.count));
  }

 private:
  // Obeys the keys that wait.
  bool quits(LiveScreen& screen) {
    for (Key key = screen.next_key(); key != Key::kNone; key = screen.next_key()) {
      if (key == Key::kQuit) return true;
      chosen_.obey(key, stats_);
    }
    if (auto note = chosen_.note()) add_note(*note);
    return false;
  }

  // Whether the figure, or a silence of the daemon, is to be drawn again.
  [[nodiscard]] bool is_due() const {
    return std::chrono::steady_clock::now() - drawn_at_ >= kFigurePeriod;
  }

  void add_note(const std::string& text) {
    notes_.push_back(clock_time().substr(0, 8) + " " + text);
    if (notes_.size() > kNotesKept) notes_.pop_front();
  }

  // Receives one message; returns true if it brought new stats. `drawn`: the figure is shown.
  bool receive(bool drawn) {
    net::Message topic, body;
    if (!connection_.receive(topic, body)) return false;
    if (topic.text() == "stats") {
      v1::Stats stats;
      if (!message::parse_bounded(stats, body.bytes())) return false;
      watch_.beat();  // nothing else is a sign of life: without stats there is nothing to show
      stats_ = std::move(stats);
      if (drawn) chosen_.update(stats_);
      return true;
    }
    if (!topic.text().starts_with("event/")) {
      chosen_.handle(topic.text(), body.bytes());
      return false;
    }
    v1::Event event;
    if (!message::parse_bounded(event, body.bytes())) return false;
    add_note(clean_name(event.stream()) + ": " + clean(event.text()));
    return false;
  }

  // Returns false if the output can no longer be seen.
  bool show(LiveScreen& screen) {
    LiveViewOptions view{.title = "posed " + options_.client.endpoint};
    screen.measure(view);
    view.notes.assign(notes_.begin(), notes_.end());
    if (screen.is_terminal()) {
      drawn_at_ = std::chrono::steady_clock::now();
      view.chosen = chosen_.name();
      view.panel = [&](int rows) { return chosen_.lines(stats_, view.width, rows); };
    }
    view.silence = watch_.silence().value_or("");
    if (!screen.is_terminal()) notes_.clear();  // plain lines: print each note once
    if (stats_.stream_size() > 0 || stats_.time_ns() != 0) {
      screen.draw(live_view(stats_, view));
    } else if (screen.is_terminal()) {
      std::vector<std::string> lines{"waiting for " + options_.client.endpoint + " (q quits)"};
      if (!view.silence.empty()) {
        for (const std::string& line : wrapped(view.silence, view.width)) {
          lines.push_back(paint(view.colour, kRed, line));
        }
      }
      screen.draw(lines);
    }
    return std::ferror(stdout) == 0;
  }

  TopOptions options_;
  Connection connection_;
  SilenceWatch watch_;
  v1::Stats stats_;
  std::deque<std::string> notes_;
  ChosenStream chosen_;
  std::optional<LineFile> record_;
  std::chrono::steady_clock::time_point drawn_at_{};
  int shown_ = 0;
};

Result<> top(const TopOptions& options) {
  OutputFiles files(options.overwrite);
  files.reads(options.client.key).reads(options.client.server_key);
  TRY(files.writes_any_but_other(options.record, {".jsonl"}).check());
  const Interrupt interrupt;
  auto connection = TRY(Connection::open(options.client, ZMQ_SUB));
  for (const char* topic : {"stats", "event/"}) {
    TRY(connection.subscribe(topic));
  }
  return Top(options, std::move(connection)).run();
}

}  // namespace

void add_top(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("top", "Watch a running daemon: rates, stage times, drops");
  auto options = std::make_shared<TopOptions>();
  add_client_options(*command, options->client, kOwnPublish);
  command->add_option("--count", options->count, "End after so many updates (one a second)")
      ->type_name("N")
      ->check(above_zero());
  auto* const control =
      command->add_option("--control", options->control,
                          std::string("The daemon's control endpoint, to change alpha (default: ") +
                              kOwnControl + " for the daemon of this computer, otherwise none)");
  control->type_name("ENDPOINT");
  add_timeout_option(*command, options->timeout_s);
  command->add_flag("--json", options->json, "One proto3 JSON object (posed.v1.Stats) a line")
      ->excludes(control);
  auto* const record =
      command->add_option("--record", options->record,
                          "Keep what is shown, too: the lines of --json, one a second, in a file");
  record->type_name("OUT.jsonl");
  add_overwrite_option(*command, options->overwrite)->needs(record);
  command->footer(std::string(R"(Examples:
  posed top
  posed top --connect tcp://127.0.0.1:5570 --count 1 | cat
  posed top --count 1 --timeout 5 --json      # a health check: exit code 1 when nothing answers
  posed top --record show.jsonl               # Ctrl-C, or a full disk, leaves whole lines
  jq -r '(.timeNs | tonumber / 1e9) as $t | .stream[] | select(.stream == "walker")
    | [$t, .rateHz, .publish.p99Us / 1000, .dropped] | @tsv' show.jsonl > walker.tsv
  gnuplot -p -e "plot 'walker.tsv' using 1:3 with lines title 'ms'"    # its latency over the time
Up and down choose a stream, left and right change its alpha, q or Ctrl-C quits. Below the table is
the chosen stream's pose, and its latency in the last minute, one bar a second: 99 % of the frames
took at most this. When stdout is no terminal it prints plain lines. A daemon that falls silent is
shown in red with the time since then, and values that may be outdated are hidden.
)") + kColumnsHelp);
  command->callback([options, &exit_code] {
    // Another daemon's streams may have the same names.
    if (options->control.empty() && options->client.endpoint == kOwnPublish) {
      options->control = kOwnControl;
    }
    exit_code = report(top(*options));
  });
}

}  // namespace posed::tools
