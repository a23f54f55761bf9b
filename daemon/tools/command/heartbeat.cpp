#include "daemon/tools/command/heartbeat.hpp"

#include <utility>

#include "proto/frame/time.hpp"

namespace posed::tools {
namespace {

constexpr double kSilence_s = 3.0;       // three stats messages are missing
constexpr double kFirstSilence_s = 1.5;  // a running daemon sends something within a second

}  // namespace

void Heartbeat::heard(std::int64_t now_ns) {
  if (reported_s_ > 0.0) returned_ = seconds(now_ns - last_ns_);
  reported_s_ = 0.0;
  last_ns_ = now_ns;
  ever_heard_ = true;
}

std::optional<double> Heartbeat::silent_s(std::int64_t now_ns) const {
  const double silence_s = seconds(now_ns - last_ns_);
  if (silence_s < (ever_heard_ ? kSilence_s : kFirstSilence_s)) return std::nullopt;
  return silence_s;
}

std::optional<double> Heartbeat::silence_to_report(std::int64_t now_ns) {
  const auto silence_s = silent_s(now_ns);
  if (!silence_s || *silence_s < 2.0 * reported_s_) return std::nullopt;
  reported_s_ = *silence_s;
  return silence_s;
}

std::optional<double> Heartbeat::return_to_report() {
  return std::exchange(returned_, std::nullopt);
}

}  // namespace posed::tools
