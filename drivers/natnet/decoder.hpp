// Decodes the datagrams of a NatNet server: passes the description of its bodies on, and makes of
// each frame one Frame for each body and one Sample for each body with markers. It also says what
// to ask the server next.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/natnet/device_time.hpp"
#include "drivers/natnet/frame.hpp"
#include "drivers/natnet/layout.hpp"
#include "drivers/natnet/requests.hpp"
#include "drivers/natnet/settings.hpp"

namespace posed::drivers::natnet {

class NatNetDecoder final : public Decoder {
 public:
  explicit NatNetDecoder(const Settings& settings);

  // Takes one datagram per call, of either socket. RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

  // Takes what make_layout made. RT-safe.
  void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const NatNetLayout*>(&layout);
  }

  // RT-safe.
  [[nodiscard]] Request next_request(std::int64_t now_ns) noexcept override {
    return {.bytes = requests_.next(now_ns), .socket = 0};
  }

 private:
  // After so many frames in a row that its reading does not fit, the version was a wrong guess.
  static constexpr int kMaxMisfits = 8;

  [[nodiscard]] Outcome accept(const Message& message, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_server_info(std::span<const std::byte> payload) noexcept;
  [[nodiscard]] Outcome accept_response(std::span<const std::byte> payload) noexcept;
  [[nodiscard]] Outcome accept_model_def(std::span<const std::byte> payload, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_frame(std::span<const std::byte> payload, Sink& sink) noexcept;

  // Reads the frame with the reading that fits; false when none does.
  [[nodiscard]] bool read(std::span<const std::byte> payload, FrameView& view) noexcept;
  [[nodiscard]] Outcome accept_bodies(const FrameView& view, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_rigid_body(ByteReader& reader, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_skeleton(ByteReader& reader, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_markers(const FrameView& view, Sink& sink) noexcept;
  // The markers of one body; emits them if there are any.
  [[nodiscard]] Outcome accept_markers_of(std::size_t body, const Entries& labelled,
                                          Sink& sink) noexcept;
  // Emits the body's frame, once for each packet.
  [[nodiscard]] Outcome emit(std::size_t body, Frame& frame, Sink& sink) noexcept;

  const Settings settings_;
  const NatNetLayout* layout_ = nullptr;  // null until the server has described its bodies
  Version version_;                       // unknown: not said yet
  Reading reading_;
  bool has_reading_ = false;
  int misfits_ = 0;  // frames since reading_ fitted
  std::uint64_t clock_hz_ = 0;
  float rate_hz_ = 0.0F;
  DeviceTime time_;
  std::int64_t device_ns_ = kNoTime_ns;  // of the frame at hand
  Timecode timecode_{};                  // the same
  DatagramOrder order_{32};
  std::bitset<kMaxBodies> emitted_;  // bodies of the frame at hand so far
  const BodyTable nobody_{};
  Requests requests_;
  std::array<std::byte, 64 * 1024 + kDescriptionHeadBytes> description_{};
};

}  // namespace posed::drivers::natnet
