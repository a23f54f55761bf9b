// Reports of a P5 to a hand and a sample each: bends, buttons and, where three or more LEDs are
// seen, where the hand is.
#pragma once

#include <array>
#include <bitset>
#include <memory>
#include <optional>

#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/p5/tower.hpp"

namespace posed::drivers::p5 {

[[nodiscard]] Result<glove::Model> model();
[[nodiscard]] SampleLayout layout(const glove::Model& model);

class P5Decoder final : public glove::GloveDecoder {
 public:
  // Without a tower the hand's place is never known.
  P5Decoder(std::shared_ptr<const Skeleton> skeleton,
            std::shared_ptr<const glove::Calibration> calibration, std::optional<Tower> tower)
      : GloveDecoder(std::move(skeleton), std::move(calibration)), tower_(std::move(tower)) {}

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 private:
  [[nodiscard]] bool advance(Sink& sink) noexcept;
  void drop(std::size_t count) noexcept;
  void take(const Report& report, Sink& sink) noexcept;
  // RT-safe.
  [[nodiscard]] bool locate(const Report& report, Place& place) noexcept;

  std::optional<Tower> tower_;
  std::array<std::byte, kReportBytes + 1> pending_{};
  std::size_t pending_bytes_ = 0;
  bool in_step_ = true;
  std::array<Spot, kLeds> before_{};  // unwrapped, as last seen
  std::array<int, kLeds> unseen_{};   // reports since then
};

}  // namespace posed::drivers::p5
