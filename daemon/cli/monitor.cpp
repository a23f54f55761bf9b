#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/client.hpp"
#include "daemon/cli/clock_time.hpp"
#include "daemon/cli/json.hpp"
#include "daemon/config/words.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::cli {
namespace {

constexpr std::chrono::seconds kPatience{3};  // then we say that we are still waiting

struct MonitorOptions {
  ClientOptions client;
  std::string stream;
  std::string topic = "pose";
  int count = 0;
  bool json = false;
};

// "QUALITY_HELD" -> "held"
std::string short_name(const std::string& name) {
  std::string out;
  for (const char c : name.substr(name.find('_') + 1)) out += static_cast<char>(c | 0x20);
  return out;
}

std::string line(const v1::Frame& frame) {
  std::string out = fmt::format("{} {:<16} {:>8} {:<9}", clock_time(), frame.stream(),
                                frame.sequence(), short_name(v1::Quality_Name(frame.quality())));
  if (frame.has_published_ns()) {
    out += fmt::format(" {:>6.0f} us",
                       static_cast<double>(frame.published_ns() - frame.arrival_ns()) * 1e-3);
  }
  if (frame.root_position_m_size() == 3) {
    out += fmt::format("  root {:7.3f} {:7.3f} {:7.3f} m", frame.root_position_m(0),
                       frame.root_position_m(1), frame.root_position_m(2));
  }
  if (!frame.label().empty()) {
    out += fmt::format("  {} {:.2f}", config::printable(frame.label()), frame.label_probability());
  }
  if (frame.lag_frames() > 0) {
    out += fmt::format("  lag {} ({:.0f} ms)", frame.lag_frames(), frame.lag_ms());
  }
  return out;
}

std::string line(const v1::Sample& sample) {
  std::string out = fmt::format("{} {:<16} {:>8} {:<9}", clock_time(), sample.stream(),
                                sample.sequence(), short_name(v1::Quality_Name(sample.quality())));
  for (int i = 0; i < sample.value_size() && i < sample.name_size(); ++i) {
    out += fmt::format(" {}={:.3f}", sample.name(i), sample.value(i));
  }
  return out;
}

std::string line(const v1::Event& event) {
  return fmt::format("{} {:<16} {:>8} {:<9} {}", clock_time(), event.stream(), event.sequence(),
                     short_name(v1::Event::Kind_Name(event.kind())).substr(5),
                     config::without_controls(event.text()));
}

std::string line(const v1::Skeleton& skeleton) {
  return fmt::format("{} {:<16} skeleton {:08x} {} {} joints, {} channels", clock_time(),
                     skeleton.stream(), skeleton.id(), config::printable(skeleton.name()),
                     skeleton.joint_name_size(), skeleton.channel_joint_size());
}

std::string line(const v1::Stats& stats) {
  std::string out = fmt::format("{} cpu {:.1f} %, rss {:.1f} MB", clock_time(), stats.cpu_percent(),
                                static_cast<double>(stats.rss_bytes()) / 1e6);
  for (const auto& stream : stats.stream()) {
    out += fmt::format("; {} {} {:.1f} Hz, {} dropped, {} shed", stream.stream(),
                       stream.away() ? "away" : stream.state(), stream.rate_hz(), stream.dropped(),
                       stream.shed());
  }
  return out;
}

// False when stdout is gone or the bytes are none of ours.
template <typename Message>
bool show(std::span<const std::byte> bytes, bool as_json) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return false;
  if (as_json) return print_json(message);
  std::puts(line(message).c_str());
  return std::fflush(stdout) == 0;
}

bool show_topic(std::string_view topic, std::span<const std::byte> bytes, bool as_json) {
  if (topic.starts_with("pose/")) return show<v1::Frame>(bytes, as_json);
  if (topic.starts_with("sensor/")) return show<v1::Sample>(bytes, as_json);
  if (topic.starts_with("event/")) return show<v1::Event>(bytes, as_json);
  if (topic.starts_with("skeleton/")) return show<v1::Skeleton>(bytes, as_json);
  return topic == "stats" && show<v1::Stats>(bytes, as_json);
}

// The topics to ask for. Beside poses, people also want to see what happens to the stream.
std::vector<std::string> topics(const MonitorOptions& options) {
  if (options.topic == "stats") return {"stats"};
  std::vector<std::string> asked{options.topic + "/" + options.stream};
  if (options.topic == "pose" && !options.json) asked.push_back("event/" + options.stream);
  return asked;
}

Result<> watch(const MonitorOptions& options) {
  const Interrupt interrupt;
  auto connection = Connection::open(options.client, ZMQ_SUB);
  if (!connection) return std::unexpected(connection.error());
  const auto asked = topics(options);
  for (const std::string& topic : asked) {
    auto set = control::set_option(connection->socket(), ZMQ_SUBSCRIBE, topic);
    if (!set) return set;
  }
  const auto start = std::chrono::steady_clock::now();
  bool said = false;
  for (int shown = 0; !Interrupt::came();) {
    if (auto refused = connection->refusal()) return std::unexpected(*refused);
    if (!connection->wait(kLookAround)) {
      if (!said && shown == 0 && std::chrono::steady_clock::now() - start > kPatience) {
        said = true;
        std::fprintf(stderr, "posed: waiting: %s\n",
                     connection->established() ? "connected, but nothing of this topic comes yet"
                                               : connection->no_answer().message.c_str());
      }
      continue;
    }
    control::Message topic, body;
    if (!topic.receive(connection->socket()) || !topic.more()) continue;
    if (!body.receive(connection->socket(), 0)) continue;
    // A subscription is a prefix: walker also brings walker-raw.
    const bool wanted = options.stream.empty() || options.topic == "stats" ||
                        std::ranges::find(asked, topic.text()) != asked.end();
    if (!wanted || !show_topic(topic.text(), body.bytes(), options.json)) {
      if (std::ferror(stdout) != 0) return {};  // whoever read us has gone
      continue;
    }
    if (topic.text().starts_with(options.topic) && ++shown == options.count) return {};
  }
  return {};
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
      ->check(CLI::PositiveNumber);
  command->add_flag("--json", options->json, "One proto3 JSON object a line");
  command->footer(R"(Examples:
  posed monitor                    # time, stream, sequence, quality, latency, root, label, lag
  posed monitor --stream walker --json --count 10  # 10 posed.v1.Frame objects
  posed monitor --topic stats --json | jq .stream[0].rateHz
The latency runs from arrival in the daemon to its publishing. A reader too slow for the stream
misses frames; it never sees old ones.)");
  command->callback([options, &exit_code] {
    if (auto done = watch(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
