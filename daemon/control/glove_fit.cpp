#include "daemon/control/glove_fit.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "daemon/devices/pose_calibration.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/pose_check.hpp"
#include "drivers/glove/traits.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::control {
namespace {

using drivers::glove::kPoseNames;
using drivers::glove::Model;
using drivers::glove::Recorded;

constexpr std::uint32_t kMinValues = 3;          // of a sensor in a pose: a page may be slow
constexpr std::uint32_t kMaxValues = 1'000'000;  // the same; hours

// Whether such values can have come from a sensor.
bool is_sound(const v1::ControlRequest::FitGlove::Held& held) {
  return held.count() >= kMinValues && held.count() <= kMaxValues && std::isfinite(held.sum()) &&
         std::isfinite(held.squares()) && held.squares() >= 0.0;
}

Result<Recorded> recorded_of(const Model& model, const v1::ControlRequest::FitGlove& wanted) {
  Recorded recorded{};
  for (const auto& pose : wanted.pose()) {
    const auto name = std::ranges::find(kPoseNames, pose.name());
    if (name == kPoseNames.end()) return fail("there is no pose " + in_quotes(pose.name()));
    auto& sensors = recorded[static_cast<std::size_t>(name - kPoseNames.begin())];
    for (const auto& held : pose.held()) {
      const auto sensor =
          std::ranges::find(model.sensors, held.sensor(), &drivers::glove::Sensor::name);
      if (sensor == model.sensors.end()) continue;  // measured, but not calibrated
      if (!is_sound(held)) {
        return fail(fmt::format("too few values of {} came while {} was held; is the glove on?",
                                sensor->name, *name));
      }
      sensors[static_cast<std::size_t>(sensor - model.sensors.begin())] = {
          .sum = held.sum(), .count = held.count(), .squares = held.squares()};
    }
  }
  return recorded;
}

void tell(const drivers::glove::PoseFinding& finding, v1::GloveFit& words) {
  v1::GloveFit::Verdict& verdict = *words.add_verdict();
  verdict.set_pose(std::string(kPoseNames[static_cast<std::size_t>(finding.pose)]));
  verdict.set_good(!finding.failed());
  verdict.set_sentence(
      finding.failed() ? clean(finding.sentence())
      : finding.sensors == 0
          ? "held; the next poses show how still"
          : fmt::format("held still: the sensors trembled by {:.0f} % of their movement",
                        100.0 * finding.unrest));
}

// Whether the thumb alone is to be fitted, to what it touches.
bool is_of_contacts(const v1::ControlRequest::FitGlove& wanted) {
  return wanted.pose_size() > 0 && std::ranges::all_of(wanted.pose(), [](const auto& pose) {
           return pose.name().starts_with("touch-");
         });
}

}  // namespace

Result<FittedGlove> fit_glove(const drivers::Description& device, const std::string& in_use,
                              const v1::ControlRequest::FitGlove& wanted) {
  const drivers::Driver* const driver = drivers::find_driver(device.driver);
  const auto side = device.skeleton ? hand_side(*device.skeleton) : std::nullopt;
  if (driver == nullptr || driver->glove == nullptr || !side) {
    return fail("it is no glove that can be calibrated");
  }
  const Side hand = *side;
  const Model model = TRY(driver->glove->glove_model(device));
  Recorded recorded = TRY(recorded_of(model, wanted));
  const Recorded held = recorded;
  auto blank = devices::blank_calibration(model, device.identity, hand, wanted.name());
  const bool contacts = is_of_contacts(wanted);
  if (contacts) {
    if (in_use.empty()) return fail("it has no calibration yet: hold the flat hand first");
    auto file = TRY(drivers::glove::parse_calibration(in_use, "the calibration in use"));
    const auto now = TRY(drivers::glove::make_calibration(model, file, hand, device.identity));
    TRY(drivers::glove::add_known_poses(model, *now, recorded));
    file.user = blank.user;
    blank = std::move(file);
  }
  auto check = TRY(drivers::glove::check_poses(model, recorded));
  std::erase_if(check.poses, [&](const drivers::glove::PoseFinding& finding) {
    return !drivers::glove::was_held(held[static_cast<std::size_t>(finding.pose)]);
  });
  FittedGlove made;
  for (const auto& finding : check.poses) tell(finding, made.words);
  if (wanted.name().empty()) return made;
  if (!check.usable()) return fail(check.verdict());
  auto fitted = TRY(contacts ? devices::calibrate_by_contacts(model, recorded, std::move(blank))
                             : devices::calibrate_by_poses(model, recorded, std::move(blank)));
  if (const std::string refusal = fitted.refusal(); !refusal.empty()) return fail(refusal);
  std::vector<std::string> sentences = std::move(fitted.said);
  std::ranges::move(fitted.warnings, std::back_inserter(sentences));
  if (contacts) check.doubts.clear();  // the fist was not held, but taken from the calibration
  std::ranges::move(fitted.doubts, std::back_inserter(check.doubts));
  sentences.push_back(check.verdict());
  for (const std::string& sentence : sentences) made.words.add_sentence(clean(sentence));
  made.toml = drivers::glove::format_calibration(fitted.file);
  return made;
}

}  // namespace posed::control
