// Bytes of a described device to samples and frames, by its Table.
//
// Three ways to find packets. A stream is tried byte by byte from where the last packet ended, so a
// damaged packet costs itself alone. With a delimiter, what stands between two of them is a packet
// or is not. A HID node hands over whole reports, so there a chunk is one or several packets and
// nothing is ever put together from two chunks.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/described/protocol.hpp"
#include "drivers/described/table.hpp"
#include "drivers/glove/glove_decoder.hpp"
#include "drivers/unrolled_counter.hpp"

namespace posed::drivers::described {

class DescribedDecoder final : public glove::GloveDecoder {
 public:
  DescribedDecoder(std::shared_ptr<const Table> table, std::shared_ptr<const Skeleton> skeleton,
                   std::shared_ptr<const glove::Calibration> default_calibration);

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 private:
  // Each gives how many of the bytes are done with.
  std::size_t take_stream(std::span<const std::byte> bytes, Sink& sink) noexcept;
  std::size_t take_delimited(std::span<const std::byte> bytes, Sink& sink) noexcept;
  void take_reports(std::span<const std::byte> bytes, Sink& sink) noexcept;

  void take_piece(std::span<const std::byte> piece, Sink& sink) noexcept;
  // Whether the values of a whole packet are in their ranges; they are kept, and emitted when the
  // packet poses.
  bool take_packet(const PacketRule& rule, std::span<const std::byte> packet, Sink& sink) noexcept;
  void keep_values(const PacketRule& rule) noexcept;  // what take_packet() read
  // One outcome a damaged piece, not one a byte.
  void damaged(Outcome why, Sink& sink) noexcept;

  std::shared_ptr<const Table> table_;
  std::array<std::byte, 2 * kMaxPacketBytes> pending_{};
  std::size_t pending_bytes_ = 0;
  std::size_t searched_ = 0;  // pending bytes that hold no delimiter
  bool in_step_ = true;       // false while hunting for the next packet
  bool skipping_ = false;     // in a piece that is longer than any packet

  std::array<double, kMaxFields> value_{};  // [field of the packet], as read
  std::array<float, glove::kMaxSensors> raw_{};
  std::bitset<glove::kMaxSensors> seen_;
  std::array<float, kMaxExtras> extra_;  // not a number while not seen
  UnrolledCounter clock_;
  double tick_ns_;
  std::int64_t device_ns_ = kNoTime_ns;
  Quality quality_ = Quality::kMeasured;
};

}  // namespace posed::drivers::described
