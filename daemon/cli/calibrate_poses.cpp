#include "daemon/cli/calibrate_poses.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include <spdlog/fmt/fmt.h>

namespace posed::cli {
namespace {

using drivers::glove::Pose;
using drivers::glove::Recorded;

constexpr int kBarWidth = 40;
constexpr std::chrono::milliseconds kRedraw{100};

}  // namespace

Result<Recorded> record_poses(GloveSource& source, const PosePlan& plan, const AskForPose& ask,
                              const ShowSensors& show) {
  Recorded recorded{};
  for (std::size_t p = 0; p < plan.seconds.size(); ++p) {
    if (plan.seconds[p] <= 0.0) continue;
    if (!ask(static_cast<Pose>(p))) return fail("stopped; no calibration was written");
    // What came while the user was reading is thrown away with the settling hand.
    if (auto ok = source.listen(plan.settle_s, show); !ok) return std::unexpected(ok.error());
    const auto keep = [&](const GloveSource::Raw& raw, const GloveSource::Valid& valid) {
      for (std::size_t i = 0; i < raw.size(); ++i) {
        if (valid[i]) recorded[p][i].add(raw[i]);
      }
      show(raw, valid);
    };
    if (auto ok = source.listen(plan.seconds[p], keep); !ok) return std::unexpected(ok.error());
  }
  return recorded;
}

SensorBars::SensorBars(const drivers::glove::Model& model)
    : model_(model), terminal_(::isatty(STDERR_FILENO) != 0) {}

void SensorBars::show(const GloveSource::Raw& raw, const GloveSource::Valid& valid) {
  const auto now = std::chrono::steady_clock::now();
  if (!terminal_ || now - last_ < kRedraw) return;
  last_ = now;
  std::string text;
  if (drawn_) text += fmt::format("\x1b[{}A", model_.sensors.size());
  for (std::size_t i = 0; i < model_.sensors.size(); ++i) {
    const drivers::glove::Sensor& sensor = model_.sensors[i];
    const double share =
        (static_cast<double>(raw[i]) - sensor.raw_min) / (sensor.raw_max - sensor.raw_min);
    const int full = valid[i] ? static_cast<int>(std::clamp(share, 0.0, 1.0) * kBarWidth) : 0;
    const std::string bar(static_cast<std::size_t>(full), '#');
    const std::string value =
        valid[i] ? fmt::format("{:8.1f}", static_cast<double>(raw[i])) : std::string("       -");
    text += fmt::format("\x1b[2K{:<14}{} |{:<{}}|\n", sensor.name, value, bar, kBarWidth);
  }
  std::fputs(text.c_str(), stderr);
  drawn_ = true;
}

void SensorBars::end() { drawn_ = false; }

}  // namespace posed::cli
