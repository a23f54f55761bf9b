// RecordSink: the recorder as the daemon's other threads see it. The calls of the hot threads copy
// into a ring and return; the recorder thread drains on its own timer, so recording costs the hot
// path no system call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/pipeline/messages.hpp"

namespace posed::pipeline {

// What a row of the log's chunks is. A device's info (Description::text) says that a link is new
// and how what follows is decoded; a calibration is its file's text, in use from the next chunk on;
// a description says which bodies a source has from there on.
enum class Direction : std::uint8_t {
  kFromDevice = 0,
  kToDevice = 1,
  kDeviceInfo = 2,
  kCalibration = 3,
  kDescription = 4
};

class RecordSink {
 public:
  RecordSink() = default;
  RecordSink(const RecordSink&) = delete;
  RecordSink& operator=(const RecordSink&) = delete;
  virtual ~RecordSink() = default;

  // Reader thread, before decoding. `next` are the numbers that the first frame, sample and item
  // made from this chunk will get: replay finds its place again after a gap. A source may have
  // several sockets; the first is 0. A full ring is counted and becomes a gap row and an event.
  // RT-safe.
  virtual void chunk(std::uint32_t stream, std::uint8_t socket, Direction direction,
                     std::int64_t arrival_ns, const pipeline::Position& next,
                     std::span<const std::byte> bytes) noexcept = 0;

  // Pipeline thread. RT-safe.
  virtual void decision(const pipeline::Decision& decision) noexcept = 0;

  // Publisher thread, in pipeline order: `bytes` is a serialized posed.v1.Frame without stage
  // stamps. Only called when wants_published(), which never changes. RT-safe.
  [[nodiscard]] virtual bool wants_published() const noexcept = 0;
  virtual void published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                         std::span<const std::byte> bytes) noexcept = 0;
  // Pipeline thread: a frame found the publisher's ring full and was not published. RT-safe.
  virtual void unpublished(std::uint32_t stream) noexcept = 0;

  // Control thread, before the command that names it: a model file's bytes, kept under their
  // SHA-256. Cold: allocates and locks.
  virtual void keep_model(std::span<const std::byte> bytes) = 0;
};

}  // namespace posed::pipeline
