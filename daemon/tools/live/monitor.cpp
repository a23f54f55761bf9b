// `posed monitor`: prints what a running daemon publishes, line by line.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/live/monitor_line.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::tools {
namespace {

// to wait for the first message of a topic of a running daemon
constexpr std::chrono::seconds kPatience{3};

struct MonitorOptions {
  ClientOptions client;
  std::string stream;
  std::string topic = "pose";
  int count = 0;
  double timeout_s = 0.0;
  bool json = false;
};

// Returns false if stdout is closed or the bytes are not a valid message.
template <typename Message>
bool show(std::span<const std::byte> bytes, bool as_json) {
  Message message;
  if (!message::parse_bounded(message, bytes)) return false;
  if (as_json) return print_json(message);
  std::printf("%s %s\n", clock_time().c_str(), monitor_line(message).c_str());
  return std::fflush(stdout) == 0;
}

bool show_topic(std::string_view topic, std::span<const std::byte> bytes, bool as_json) {
  if (topic.starts_with("pose/")) return show<v1::Frame>(bytes, as_json);
  if (topic.starts_with("sensor/")) return show<v1::Sample>(bytes, as_json);
  if (topic.starts_with("event/")) return show<v1::Event>(bytes, as_json);
  if (topic.starts_with("skeleton/")) return show<v1::Skeleton>(bytes, as_json);
  return topic == "stats" && show<v1::Stats>(bytes, as_json);
}

// The topics to subscribe to. Beside poses, users also want to see the stream's events.
std::vector<std::string> topics(const MonitorOptions& options) {
  if (options.topic == "stats") return {"stats"};
  std::vector<std::string> asked{options.topic + "/" + options.stream};
  if (options.topic == "pose" && !options.json) asked.push_back("event/" + options.stream);
  return asked;
}

// Runs until the user ends it; returns an error if it must end. Also subscribes to `stats`, which a
// running daemon sends every second, whatever the topic.
class Monitor {
 public:
  Monitor(const MonitorOptions& options, Connection connection)
      : options_(options),
        connection_(std::move(connection)),
        asked_(topics(options)),
        watch_(connection_, options.timeout_s) {}

  Result<> run() {
    for (const std::string& topic : asked_) {
      TRY(connection_.subscribe(topic));
    }
    TRY(connection_.subscribe("stats"));
    while (!Interrupt::came() && !finished_) {
      if (auto refused = connection_.refusal()) return std::unexpected(*refused);
      if (auto given_up = watch_.report()) return std::unexpected(*given_up);
      if (stream_is_late()) {
        return fail(fmt::format("{} answers, but nothing of {} came in {} s (--timeout)",
                                options_.client.endpoint, asked_.front(), options_.timeout_s));
      }
      if (connection_.wait(kLookAround)) {
        TRY(receive());
      } else {
        report_quiet_topic();
      }
    }
    if (options_.count > 0 && shown_ < options_.count) {
      return fail(fmt::format("interrupted after {} of {} messages", shown_, options_.count));
    }
    return {};
  }

 private:
  Result<> receive() {
    net::Message topic, body;
    if (!connection_.receive(topic, body)) return {};
    if (topic.text() == "stats") {
      TRY(look_at(body.bytes()));
    }
    // A subscription is a prefix: walker also matches walker-raw.
    const bool all = options_.stream.empty() && topic.text() != "stats";
    if (!all && std::ranges::find(asked_, topic.text()) == asked_.end()) return {};
    if (show_topic(topic.text(), body.bytes(), options_.json)) {
      watch_.beat();
    } else {
      finished_ = std::ferror(stdout) != 0;  // the reader of stdout has gone
      if (finished_) shown_ = options_.count;
      return {};
    }
    finished_ = topic.text().starts_with(options_.topic) && ++shown_ == options_.count;
    return {};
  }

  // The first stats show which streams there are, and whether this is a replay. A name that is not
  // there is an error, unless streams come and go here, as bodies of sources do.
  Result<> look_at(std::span<const std::byte> bytes) {
    v1::Stats stats;
    if (!message::parse_bounded(stats, bytes)) return {};
    watch_.beat();
    if (looked_ || stats.stream().empty()) return {};
    looked_ = true;
    if (!stats.replay_file().empty()) {
      std::fprintf(stderr, "posed: %s\n", replay_words(stats).c_str());
    }
    std::string names;
    for (const auto& stream : stats.stream()) {
      const std::string& name = stream.stream();
      if (options_.stream.empty() || options_.stream == name || options_.stream == raw_name(name)) {
        return {};
      }
      add_word(names, name);
    }
    const std::string sentence =
        fmt::format("the daemon at {} has no stream '{}'; it has: {}", options_.client.endpoint,
                    options_.stream, clean(names));
    if (stats.source().empty()) return fail(sentence);
    quiet_topic_reported_ = true;
    std::fprintf(stderr, "posed: waiting for it to come: %s\n", sentence.c_str());
    return {};
  }

  // A stream that was named and has not sent anything yet. Events may be rare for good.
  [[nodiscard]] bool stream_is_late() const {
    return options_.timeout_s > 0.0 && !options_.stream.empty() && options_.topic != "event" &&
           looked_ && shown_ == 0 &&
           std::chrono::steady_clock::now() - start_ >=
               std::chrono::duration<double>(options_.timeout_s);
  }

  void report_quiet_topic() {
    if (quiet_topic_reported_ || shown_ > 0 || !looked_) return;
    if (std::chrono::steady_clock::now() - start_ < kPatience) return;
    quiet_topic_reported_ = true;
    std::fprintf(stderr, "posed: waiting: %s answers, but nothing of %s comes yet\n",
                 options_.client.endpoint.c_str(), asked_.front().c_str());
  }

  const MonitorOptions& options_;
  Connection connection_;
  std::vector<std::string> asked_;
  SilenceWatch watch_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  int shown_ = 0;
  bool looked_ = false;
  bool quiet_topic_reported_ = false;
  bool finished_ = false;
};

Result<> watch(const MonitorOptions& options) {
  if (options.topic == "stats" && !options.stream.empty()) {
    return misuse("stats are of all streams: leave out --stream, or choose another --topic");
  }
  const Interrupt interrupt;
  auto connection = TRY(Connection::open(options.client, ZMQ_SUB));
  return Monitor(options, std::move(connection)).run();
}

}  // namespace

void add_monitor(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("monitor", "Print what a running daemon publishes");
  auto options = std::make_shared<MonitorOptions>();
  add_client_options(*command, options->client, "tcp://127.0.0.1:5570");
  command->add_option("--stream", options->stream, "Only this stream")->type_name("NAME");
  command->add_option("--topic", options->topic, "What to print")
      ->check(CLI::IsMember({"pose", "sensor", "event", "skeleton", "stats"}))
      ->capture_default_str();
  command->add_option("--count", options->count, "End after so many messages")
      ->type_name("N")
      ->check(above_zero());
  add_timeout_option(*command, options->timeout_s);
  command->add_flag("--json", options->json, "One proto3 JSON object a line");
  command->footer(R"(Examples:
  posed monitor                    # time, stream, sequence, quality, latency, root, label, lag
  posed monitor --stream walker --json --count 10  # 10 posed.v1.Frame objects
  posed monitor --topic event      # what happens: a glove lost, alpha changed, labels performed
  posed monitor --topic stats --json | jq .stream[0].rateHz
The quality is measured, predicted (computed for a moment without a measurement), held (the same
measurement again), stale (the source is silent) or performed (made from labels). The latency runs
from arrival in the daemon to its publishing; a replay as fast as possible has none. A reader too
slow for the stream misses frames; it never sees old ones. A daemon that falls silent is reported on
stderr. With --count the exit code is 1 unless so many came. --timeout looks at the daemon, and at
the stream named with --stream until it first comes.)");
  command->callback([options, &exit_code] { exit_code = report(watch(*options)); });
}

}  // namespace posed::tools
