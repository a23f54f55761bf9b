// Decodes the bytes of a table-driven device into samples and frames, using its Table.
//
// There are three ways to find packets. A byte stream is searched byte by byte from the end of the
// last packet, so a damaged packet affects only itself. With a delimiter, the bytes between two
// delimiters are either one packet or discarded. A HID node delivers whole reports, so there a
// chunk is one or several packets, and bytes of two chunks are never joined.
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

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  // Each returns the number of bytes consumed.
  std::size_t accept_stream(std::span<const std::byte> bytes, Sink& sink) noexcept;
  std::size_t accept_delimited(std::span<const std::byte> bytes, Sink& sink) noexcept;
  void accept_reports(std::span<const std::byte> bytes, Sink& sink) noexcept;

  void accept_piece(std::span<const std::byte> piece, Sink& sink) noexcept;
  // True when the values of a whole packet are in range; they are then stored, and emitted if the
  // packet contains a pose.
  bool accept_packet(const PacketRule& rule, std::span<const std::byte> packet,
                     Sink& sink) noexcept;
  void keep_values(const PacketRule& rule) noexcept;  // stores what accept_packet() read
  // Counts one outcome per damaged piece, not one per byte.
  void damaged(Outcome why, Sink& sink) noexcept;

  std::shared_ptr<const Table> table_;
  std::array<std::byte, 2 * kMaxPacketBytes> pending_{};
  std::size_t pending_bytes_ = 0;
  std::size_t searched_ = 0;  // pending bytes already searched for a delimiter
  bool in_step_ = true;       // false while searching for the next packet
  // Inside a piece longer than any packet, or in a device's first line, whose begin may be missing.
  bool skipping_ = false;

  std::array<double, kMaxFields> value_{};  // [field of the packet], as read
  std::array<float, glove::kMaxSensors> raw_{};
  std::bitset<glove::kMaxSensors> seen_;
  std::array<float, kMaxExtras> extra_;  // NaN until first received
  UnrolledCounter clock_;
  double tick_ns_;
  std::int64_t device_ns_ = kNoTime_ns;
  Quality quality_ = Quality::kMeasured;
};

}  // namespace posed::drivers::described
