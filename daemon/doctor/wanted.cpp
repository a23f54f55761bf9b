#include "daemon/doctor/wanted.hpp"

#include <algorithm>

namespace posed::doctor {
namespace {

constexpr double kAssumedRate_hz = 120.0;  // where only the device knows
constexpr std::size_t kAssumedBodies = 4;  // of a source whose bodies the config does not name
// Measured on a walk from a BVH at 120 Hz: a row with a line of the clip (packets are shorter), and
// a row with the published frame.
constexpr double kChunk_bytes = 900.0;
constexpr double kFrame_bytes = 1100.0;

const drivers::Driver* driver_of(const std::string& name) { return drivers::find_driver(name); }

// Whether it is a glove on a port of this machine; an emulated one has its port elsewhere.
bool is_glove(const config::StreamConfig& stream) {
  const drivers::Driver* driver = driver_of(stream.driver);
  const std::string port = text_option(stream.options, "port");
  return driver != nullptr && driver->glove != nullptr &&
         text_option(stream.options, "link") != "tcp" &&
         (port.empty() || port.starts_with("/dev/"));
}

// The address behind "tcp://", with numbers for every address of this machine ("*"). Empty if the
// system chooses the port, or the endpoint is none of TCP.
std::string tcp_address(std::string_view endpoint) {
  constexpr std::string_view kTcp = "tcp://";
  if (!endpoint.starts_with(kTcp) || endpoint.ends_with(":*") || endpoint.ends_with(":0")) {
    return {};
  }
  std::string address(endpoint.substr(kTcp.size()));
  if (address.starts_with("*:")) address.replace(0, 1, "0.0.0.0");
  if (address.starts_with("localhost:")) address.replace(0, 9, "127.0.0.1");
  return address;
}

// Empty where the options name no address to listen on. Those of mocap systems over TCP connect.
Listener listener_of(const std::string& who, const drivers::Options& options) {
  const std::string link = text_option(options, "link");
  const bool connects = options.contains("connect") && link == "tcp";
  const bool other_link = !link.empty() && link != "tcp" && link != "udp";
  // A described glove may be on a serial port: then its description says so, and not its options.
  const bool unknown_link = link.empty() && options.contains("port");
  if (connects || other_link || unknown_link) return {};
  return {.who = who,
          .udp = link != "tcp",
          .endpoint = text_option(options, "listen"),
          .shared = !text_option(options, "group").empty()};
}

double bytes_per_s(double rate_hz, std::size_t bodies, bool frames) {
  const double rate = rate_hz > 0.0 ? rate_hz : kAssumedRate_hz;
  return rate * static_cast<double>(bodies) * (kChunk_bytes + (frames ? kFrame_bytes : 0.0));
}

}  // namespace

std::string text_option(const drivers::Options& options, std::string_view name) {
  const auto found = options.find(std::string(name));
  if (found == options.end() || !std::holds_alternative<std::string>(found->second)) return {};
  return std::get<std::string>(found->second);
}

bool wants_gloves(const config::DaemonConfig& config) {
  return std::ranges::any_of(config.streams, is_glove);
}

std::vector<Listener> listeners_of(const config::DaemonConfig& config) {
  std::vector<Listener> all{{.who = "publish", .endpoint = tcp_address(config.publish_endpoint)},
                            {.who = "control", .endpoint = tcp_address(config.control_endpoint)}};
  if (config.trigger) {
    all.push_back({.who = "trigger", .udp = true, .endpoint = config.trigger->listen});
  }
  if (config.metrics) all.push_back({.who = "metrics", .endpoint = config.metrics->listen});
  for (const config::OutputConfig& output : config.outputs) {
    if (output.kind != config::OutputKind::kBvh) continue;
    all.push_back({.who = "output " + output.name, .endpoint = output.listen});
  }
  for (const config::StreamConfig& stream : config.streams) {
    all.push_back(listener_of("stream " + stream.name, stream.options));
  }
  for (const config::SourceConfig& source : config.sources) {
    all.push_back(listener_of("source " + source.name, source.options));
  }
  std::erase_if(all, [](const Listener& one) {
    return one.endpoint.empty() || one.endpoint.ends_with(":0");
  });
  return all;
}

double recorded_bytes_per_s(const config::DaemonConfig& config) {
  const bool frames = config.record && config.record->frames;
  double sum = 0.0;
  for (const config::StreamConfig& stream : config.streams) {
    const drivers::Driver* driver = driver_of(stream.driver);
    const bool known = driver != nullptr && driver->expect != nullptr;
    const auto expected = known ? driver->expect(stream.options) : fail("only the device knows");
    sum += bytes_per_s(expected ? expected->rate_hz : 0.0, 1, frames);
  }
  for (const config::SourceConfig& source : config.sources) {
    const std::size_t bodies =
        source.all ? std::max(kAssumedBodies, source.named.size()) : source.named.size();
    sum += bytes_per_s(source.rate_hz, bodies, frames);
  }
  return sum;
}

}  // namespace posed::doctor
