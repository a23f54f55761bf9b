// Decodes each packet of a 5DT glove into a frame and a sample.
#pragma once

#include <array>
#include <memory>

#include "drivers/fivedt/framer.hpp"
#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/model.hpp"

namespace posed::drivers::fivedt {

// Default values of a 12-bit glove's sensor when the finger is straight and when it is closed, used
// without a calibration. VRPN's own thresholds are 1490 and 3030.
inline constexpr double kStraight = 1500.0;
inline constexpr double kBent = 3000.0;

// What the options and the device info say.
struct Settings {
  Side hand = Side::kRight;
  Form form = Form::kFive;
  bool polled = false;  // in polled mode an exact repeat is the same measurement again
  bool port_b = false;  // which glove of an Ultra Wireless kit
};

Result<glove::Model> model(Form form);
[[nodiscard]] SampleLayout layout(const glove::Model& model, Form form);

class FiveDtDecoder final : public glove::GloveDecoder, private Readings {
 public:
  FiveDtDecoder(std::shared_ptr<const Skeleton> skeleton,
                std::shared_ptr<const glove::Calibration> calibration, const Settings& settings)
      : GloveDecoder(std::move(skeleton), std::move(calibration)),
        settings_(settings),
        framer_(settings.form) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  void reading(const Reading& reading) noexcept override;
  void outcome(Outcome outcome) noexcept override { sink_->outcome(outcome); }

  Settings settings_;
  Framer framer_;
  Sink* sink_ = nullptr;  // of the current call of feed()
  std::array<std::uint16_t, kMaxValues> before_{};
  bool has_before_ = false;
};

}  // namespace posed::drivers::fivedt
