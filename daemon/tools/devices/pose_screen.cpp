#include "daemon/tools/devices/pose_screen.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace posed::tools {
namespace {

using drivers::glove::kPoseHints;
using drivers::glove::kPoseNames;
using drivers::glove::Pose;
using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kRedraw{66};
constexpr std::chrono::seconds kSilence{1};
constexpr double kNoiseShare = 0.04;  // share of a sensor's range

}  // namespace

PoseScreen::PoseScreen(const drivers::glove::Model& model, const PosePlan& plan, std::string title,
                       std::string note) {
  view_.title = std::move(title);
  view_.note = std::move(note);
  view_.poses = plan.poses();
  for (const drivers::glove::Sensor& sensor : model.sensors) {
    view_.sensors.push_back({.name = sensor.name,
                             .least = sensor.raw_min,
                             .most = sensor.raw_max,
                             .least_span = kNoiseShare * (sensor.raw_max - sensor.raw_min)});
  }
  heard_ = SteadyClock::now();
}

// Discards keys that were pressed before this pose was asked for: a superfluous Enter would start
// it.
void PoseScreen::want(Pose pose) {
  while (screen_.key_pressed() != 0) {
  }
  view_.pose = static_cast<std::size_t>(std::ranges::find(view_.poses, pose) - view_.poses.begin());
  view_.any_held = ranging_;
  view_.phase = PosePhase::kAsked;
  view_.left_s = view_.share = 0.0;
  draw();
}

PoseGuide::Word PoseScreen::hear() {
  if (SteadyClock::now() - drawn_ >= kRedraw) draw();
  for (char key = screen_.key_pressed(); key != 0; key = screen_.key_pressed()) {
    if (key == '\n' || key == '\r') return Word::kGo;
    if (key == 'b' || key == 'B') return Word::kBack;
    if (key == 'q' || key == 'Q') return Word::kStop;
  }
  return Word::kNothing;
}

void PoseScreen::show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
                      double left_s, double whole_s) {
  heard_ = SteadyClock::now();
  view_.phase = phase;
  view_.left_s = std::max(left_s, 0.0);
  view_.share = whole_s > 0.0 ? 1.0 - view_.left_s / whole_s : 0.0;
  if (phase != PosePhase::kAsked) view_.note.clear();  // it was about the previous pose
  const bool first_held = phase == PosePhase::kHeld && !ranging_;
  ranging_ = ranging_ || first_held;
  for (std::size_t i = 0; i < view_.sensors.size(); ++i) {
    if (!valid[i]) continue;
    SensorView& sensor = view_.sensors[i];
    sensor.value = static_cast<double>(raw[i]);
    if (first_held || !sensor.there || !ranging_) sensor.low = sensor.high = sensor.value;
    sensor.there = true;
    sensor.low = std::min(sensor.low, sensor.value);
    sensor.high = std::max(sensor.high, sensor.value);
  }
  if (SteadyClock::now() - drawn_ >= kRedraw) draw();
}

void PoseScreen::restless(Pose pose, const std::string& sensor) {
  view_.note = "The hand moved while " + std::string(kPoseNames[static_cast<std::size_t>(pose)]) +
               " was held (" + sensor + "). b: hold it again";
}

void PoseScreen::draw() {
  drawn_ = SteadyClock::now();
  view_.silent = drawn_ - heard_ >= kSilence;
  LiveViewOptions size;
  screen_.measure(size);
  view_.width = size.width;
  view_.height = size.height;
  view_.colour = size.colour;
  screen_.draw(calibrate_view(view_));
}

void PoseLines::want(Pose pose) {
  const auto index = static_cast<std::size_t>(pose);
  std::printf("pose %s\n", std::string(kPoseNames[index]).c_str());
  std::fflush(stdout);
  std::fprintf(stderr, "%s: %s%s\n", std::string(kPoseNames[index]).c_str(),
               std::string(kPoseHints[index]).c_str(), waits_ ? "; then press Enter" : "");
}

void PoseLines::restless(Pose pose, const std::string& sensor) {
  std::fprintf(stderr, "posed: warning: the hand moved while %s was held (%s)\n",
               std::string(kPoseNames[static_cast<std::size_t>(pose)]).c_str(), sensor.c_str());
}

PoseGuide::Word PoseLines::hear() {
  pollfd line{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  while (waits_ && ::poll(&line, 1, 0) > 0) {
    char c = 0;
    if (::read(STDIN_FILENO, &c, 1) != 1) {
      std::fprintf(stderr, "stdin has ended; with --seconds each pose begins by itself\n");
      return Word::kStop;
    }
    if (c == '\n') return Word::kGo;
  }
  return Word::kNothing;
}

}  // namespace posed::tools
