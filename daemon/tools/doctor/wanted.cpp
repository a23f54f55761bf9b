#include "daemon/tools/doctor/wanted.hpp"

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
  const std::string port = config::text_option(stream.options, "port");
  return driver != nullptr && driver->glove != nullptr &&
         config::text_option(stream.options, "link") != "tcp" &&
         (port.empty() || port.starts_with("/dev/"));
}

double bytes_per_s(double rate_hz, std::size_t bodies, bool frames) {
  const double rate = rate_hz > 0.0 ? rate_hz : kAssumedRate_hz;
  return rate * static_cast<double>(bodies) * (kChunk_bytes + (frames ? kFrame_bytes : 0.0));
}

}  // namespace

bool wants_gloves(const config::DaemonConfig& config) {
  return std::ranges::any_of(config.streams, is_glove);
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
