#include "drivers/p5/decoder.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include "drivers/glove/angle_map.hpp"
#include "proto/frame/plausible.hpp"

namespace posed::drivers::p5 {
namespace {

// Reports, half a second: older observations of a LED do not help to unwrap.
constexpr int kForgotten = 25;
constexpr std::size_t kPlaceAt = 4;  // index among the extras
const std::array<std::string, 11> kExtras{"button_a", "button_b", "button_c", "leds",
                                          "palm_x",   "palm_y",   "palm_z",   "palm_qx",
                                          "palm_qy",  "palm_qz",  "palm_qw"};

}  // namespace

std::optional<CameraRig> Settings::rig() const {
  if (heads.size() != kHeadsBytes || leds.size() != kLedsBytes) return {};
  return CameraRig::of(std::span(heads).first<kHeadsBytes>(), std::span(leds).first<kLedsBytes>());
}

Result<glove::Model> model() {
  glove::Model model{.driver = "p5", .sensors = {}};
  for (const std::string_view finger : kFingerNames) {
    model.sensors.push_back({.name = std::string(finger),
                             .raw_max = kMaxBend,
                             .curve = glove::Curve::line(0.0, 0.0, kMaxBend, 1.0),
                             .unit = "1"});
  }
  return glove::with_device_table(std::move(model), "p5");
}

SampleLayout layout(const glove::Model& model) {
  SampleLayout layout = glove::sample_layout(model, kExtras);
  const std::string metre(1, 'm');
  std::fill_n(layout.units.end() - (kExtras.size() - kPlaceAt), 3, metre);
  return layout;
}

RT_SAFE void P5Decoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                             Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    assert(pending_bytes_ < pending_.size());
    pending_[pending_bytes_++] = byte;
    while (pending_bytes_ > 0 && advance(sink)) {
    }
  }
}

// Over USB reports arrive complete; a log or a test may split and damage them.
RT_SAFE bool P5Decoder::advance(Sink& sink) noexcept {
  const bool begins = pending_[0] == std::byte{1};
  if (!begins) {
    if (in_step_) sink.outcome(Outcome::kForeign);
    in_step_ = false;
    drop(1);
    return true;
  }
  if (pending_bytes_ < kReportBytes + (in_step_ ? 0 : 1)) return false;
  if (!in_step_) {
    // The last byte is unused and zero, and another report must follow.
    in_step_ = pending_[kReportBytes - 1] == std::byte{0} && pending_[kReportBytes] == pending_[0];
    if (!in_step_) drop(1);
    return true;
  }
  Report report;
  const Outcome outcome = decode_report(std::span(pending_).first(kReportBytes), report);
  drop(kReportBytes);
  sink.outcome(outcome);
  accept(report, sink);
  return true;
}

RT_SAFE void P5Decoder::drop(std::size_t count) noexcept {
  std::copy(pending_.begin() + static_cast<std::ptrdiff_t>(count),
            pending_.begin() + static_cast<std::ptrdiff_t>(pending_bytes_), pending_.begin());
  pending_bytes_ -= count;
}

RT_SAFE bool P5Decoder::locate(const Report& report, RigidPose& place) noexcept {
  for (int& reports : unseen_) reports = std::min(reports + 1, kForgotten);
  if (!rig_) return false;
  std::array<Eigen::Vector3d, kLeds> position_m;
  std::bitset<kLeds> seen;
  for (const LedObservation& spot : report.spot) {
    if (spot.led >= kLeds) continue;
    LedObservation& before = before_[spot.led];
    LedObservation now = spot;
    if (unseen_[spot.led] < kForgotten) {
      now.v1 = unwrapped(spot.v1, before.v1);
      now.v2 = unwrapped(spot.v2, before.v2);
      now.h = unwrapped(spot.h, before.h);
    }
    before = now;
    unseen_[spot.led] = 0;
    seen[spot.led] = rig_->locate(now, position_m[spot.led]);
  }
  return fit_hand(*rig_, position_m, seen, place) && place.position_m.norm() <= kMaxPosition_m;
}

RT_SAFE void P5Decoder::accept(const Report& report, Sink& sink) noexcept {
  std::array<float, kFingers> raw{};
  for (std::size_t f = 0; f < kFingers; ++f) raw[f] = static_cast<float>(report.bend[f]);
  std::array<float, kExtras.size()> extra{};
  for (std::size_t b = 0; b < 3; ++b) extra[b] = (report.buttons >> b & 1) != 0 ? 1.0F : 0.0F;
  extra[3] = static_cast<float>(std::ranges::count_if(
      report.spot, [](const LedObservation& spot) { return spot.led < kLeds; }));
  std::fill(extra.begin() + kPlaceAt, extra.end(), std::numeric_limits<float>::quiet_NaN());
  if (RigidPose place; locate(report, place)) {
    for (int i = 0; i < 3; ++i) {
      extra[kPlaceAt + static_cast<std::size_t>(i)] = static_cast<float>(place.position_m[i]);
    }
    for (int i = 0; i < 4; ++i) {
      extra[kPlaceAt + 3 + static_cast<std::size_t>(i)] =
          static_cast<float>(place.rotation.coeffs()[i]);
    }
  }
  glove::Packet packet{.raw = raw, .valid = {}, .extra = extra};
  for (std::size_t f = 0; f < kFingers; ++f) packet.valid[f] = true;
  emit(packet, sink);
}

}  // namespace posed::drivers::p5
