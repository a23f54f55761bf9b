// Decodes each report of a P5 into a frame and a sample: bends, buttons and, when three or more
// LEDs are seen, the pose of the hand.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/p5/camera_rig.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::p5 {

// The device info of a P5 has its feature reports as received, in hexadecimal, so that a log is
// decoded with the geometry of the rig with which it was recorded. A missing report is written as
// none.
//   p5 hand=right firmware=090403 heads=06.. leds=0c..
struct Settings {
  Side hand = Side::kRight;
  std::vector<std::byte> firmware{}, heads{}, leds{};  // reports 9, 6 and 12; empty: not known

  // The rig is not known unless both of its reports are.
  [[nodiscard]] std::optional<CameraRig> rig() const;
};

[[nodiscard]] std::string device_info_of(const Settings& settings);
Result<Settings> parse_device_info(const std::string& text, const std::string& identity);
Result<glove::Model> model();
[[nodiscard]] SampleLayout layout(const glove::Model& model);

class P5Decoder final : public glove::GloveDecoder {
 public:
  // Without a rig the decoder never knows the hand's pose.
  P5Decoder(std::shared_ptr<const Skeleton> skeleton,
            std::shared_ptr<const glove::Calibration> calibration, std::optional<CameraRig> rig)
      : GloveDecoder(std::move(skeleton), std::move(calibration)), rig_(std::move(rig)) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  [[nodiscard]] bool advance(Sink& sink) noexcept;
  void drop(std::size_t count) noexcept;
  void accept(const Report& report, Sink& sink) noexcept;
  RT_SAFE [[nodiscard]] bool locate(const Report& report, RigidPose& place) noexcept;

  std::optional<CameraRig> rig_;
  std::array<std::byte, kReportBytes + 1> pending_{};
  std::size_t pending_bytes_ = 0;
  bool in_step_ = true;
  std::array<LedObservation, kLeds> before_{};  // last observation, unwrapped
  std::array<int, kLeds> unseen_{};             // reports since the last observation
};

}  // namespace posed::drivers::p5
