// Decodes each packet of a 5DT glove into a frame and a sample.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <memory>
#include <span>

#include "drivers/fivedt/protocol.hpp"
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

// Receives the packets that a Framer finds. RT-safe.
class Readings {
 public:
  Readings() = default;
  Readings(const Readings&) = delete;
  Readings& operator=(const Readings&) = delete;
  virtual ~Readings() = default;

  virtual void reading(const Reading& reading) noexcept = 0;  // called after its kOk
  virtual void outcome(Outcome outcome) noexcept = 0;
};

// Splits the byte stream of a 5DT glove into packets. The start of a packet is found by its
// checksum (Data Glove 5), its shape (16, USB) or only its regular spacing (Ultra Wireless).
class Framer {
 public:
  explicit Framer(Form form) noexcept : form_(form) {}

  // Reads bytes cut at any position.
  RT_SAFE void feed(std::span<const std::byte> bytes, Readings& readings) noexcept;

  // The last byte that a wireless glove sent after a packet; -1: none yet.
  RT_SAFE [[nodiscard]] int capability() const noexcept { return capability_; }

 private:
  [[nodiscard]] bool advance(Readings& readings) noexcept;
  [[nodiscard]] bool advance_in_step(Readings& readings) noexcept;
  [[nodiscard]] bool advance_hunting() noexcept;
  [[nodiscard]] bool skip_damaged() noexcept;
  [[nodiscard]] bool is_packet(std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] bool is_tail(std::byte byte) const noexcept;
  [[nodiscard]] bool consume_tail() noexcept;
  [[nodiscard]] bool is_half_used(std::span<const std::byte> report) noexcept;
  void drop(std::size_t count) noexcept;
  [[nodiscard]] std::span<const std::byte> pending() const noexcept {
    return std::span(pending_).first(pending_bytes_);
  }

  Form form_;
  std::array<std::byte, 2 * kMaxPacket + 1> pending_{};  // a packet, its tail and the next one
  std::size_t pending_bytes_ = 0;
  bool in_step_ = true;        // false while searching; one outcome per search, not per byte
  bool just_lost_ = false;     // the packet after the damaged one was not tried yet
  bool after_packet_ = false;  // a tail may follow
  int capability_ = -1;
  std::size_t hunted_ = 0;  // bytes discarded since the last packet
  std::bitset<256> ports_;  // second bytes of an Ultra Wireless kit's records so far
  enum class Tail : std::uint8_t { kUnknown, kZero, kUsed } usb_tail_ = Tail::kUnknown;
};

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
