// Decodes the bytes of a CyberGlove into samples and frames: one decoder for each form.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/cyberglove/protocol.hpp"
#include "drivers/glove/glove_decoder.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::cyberglove {

inline constexpr std::size_t kExtras = 2;  // switch, light

class CyberGloveDecoder : public glove::GloveDecoder {
 public:
  CyberGloveDecoder(std::shared_ptr<const Skeleton> skeleton,
                    std::shared_ptr<const glove::Calibration> calibration, Side hand,
                    const Layout& layout)
      : GloveDecoder(std::move(skeleton), std::move(calibration)), hand_(hand), layout_(layout) {}

 protected:
  [[nodiscard]] const Layout& layout() const noexcept { return layout_; }

 private:
  void compute(std::span<float> value, Valid& valid) const noexcept final {
    compute_angles(calibration().parameter[kAbductionBias], hand_, layout_.mask, value, valid);
  }

  Side hand_;
  Layout layout_;
};

// Turns the glove's time stamps into an increasing time, even on a noisy line. Counts modulo
// `range`. Stamps have no checksum, so a step of more than `plausible` counts (or backwards) is
// accepted only when the next stamp confirms it; until then time advances by one tick per stamp. A
// confirmed step forward (a pause) is taken in full; after a confirmed step backwards (a restart)
// time continues from where it was.
class StampClock {
 public:
  StampClock(std::int64_t range, std::int64_t plausible) noexcept
      : range_(range), plausible_(plausible) {}

  // Ticks since the first stamp; increases with every call.
  RT_SAFE std::int64_t to(std::int64_t count) noexcept {
    if (!last_) {
      last_ = count;
      return ticks_;
    }
    std::int64_t step = forward(*last_, count);
    if (step > plausible_) {
      const bool confirmed = doubted_ && forward(*doubted_, count) <= plausible_;
      if (!confirmed) {
        doubted_ = count;
        return ++ticks_;
      }
      if (step > range_ / 2) step = forward(*doubted_, count);
    }
    doubted_.reset();
    last_ = count;
    ticks_ = std::max(ticks_ + 1, known_ + step);
    known_ += step;
    return ticks_;
  }

 private:
  [[nodiscard]] std::int64_t forward(std::int64_t from, std::int64_t to) const noexcept {
    return (to - from + range_) % range_;
  }

  std::int64_t range_, plausible_;
  std::optional<std::int64_t> last_, doubted_;  // counts
  std::int64_t known_ = 0;                      // ticks at last_
  std::int64_t ticks_ = 0;                      // last value returned
};

// Finds samples by length and end mark together: 'S' is a legal value, and no byte inside is zero.
class Decoder8 final : public CyberGloveDecoder {
 public:
  using CyberGloveDecoder::CyberGloveDecoder;

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  void accept_piece(Sink& sink) noexcept;
  [[nodiscard]] Outcome check_piece(std::span<const std::byte> piece) const noexcept;
  void accept_sample(std::span<const std::byte> piece, Sink& sink) noexcept;

  std::array<std::byte, kMaxSample> piece_{};  // bytes since the last end mark
  std::size_t size_ = 0;
  bool lost_ = false;  // the piece is longer than any sample and is discarded
  StampClock clock_{std::int64_t{1} << 32, std::int64_t{10} * 115200};
  std::array<std::byte, kSensors + kStampBytes> before_{};  // the last sample, without its status
};

// Finds records by the pattern of their time and their end: zeros are legal inside.
class Decoder16 final : public CyberGloveDecoder {
 public:
  Decoder16(std::shared_ptr<const Skeleton> skeleton,
            std::shared_ptr<const glove::Calibration> calibration, Side hand,
            const Layout& record_layout)
      : CyberGloveDecoder(std::move(skeleton), std::move(calibration), hand, record_layout),
        clock_(sub_frames_a_day(record_layout.multiplier),
               std::int64_t{10} * kFrames_hz * record_layout.multiplier) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  void add(std::byte byte, Sink& sink) noexcept;
  void hunt(Sink& sink) noexcept;
  [[nodiscard]] bool could_be_record() const noexcept;
  void accept_record(Sink& sink) noexcept;

  std::array<std::byte, kRecordBytes> record_{};
  std::size_t size_ = 0;
  std::size_t strays_ = 0;  // bytes since the last record that belong to no record
  bool reported_ = false;   // the present search has already counted an outcome
  StampClock clock_;
};

}  // namespace posed::drivers::cyberglove
