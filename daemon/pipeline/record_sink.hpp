// RecordSink: the recorder as the other threads of the daemon see it. Calls from the hot threads
// copy into a ring and return. The recorder thread empties the rings on its own timer, so recording
// adds no system call to the hot path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/take.hpp"

namespace posed::pipeline {

// The kind of a row in the log's chunk table. A device info (Description::text) marks a new link
// and says how the following chunks are decoded. A calibration is the text of its file and applies
// from the next chunk on. A description lists the bodies that a source has from there on.
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

  // Reader thread, before decoding. `next` holds the numbers that the first frame, sample and item
  // made from this chunk will get; with them replay can continue after a gap. A source may have
  // several sockets; the first is 0. If the ring is full the chunk is counted as lost, and the log
  // gets a gap row and an event.
  RT_SAFE virtual void chunk(std::uint32_t source, std::uint8_t socket, Direction direction,
                             std::int64_t arrival_ns, const pipeline::Position& next,
                             std::span<const std::byte> bytes) noexcept = 0;

  // Pipeline thread.
  RT_SAFE virtual void decision(const pipeline::Decision& decision) noexcept = 0;

  // Publisher thread, in pipeline order. `bytes` is a serialized posed.v1.Frame without stage
  // stamps. Called only if wants_published(), whose value never changes.
  RT_SAFE [[nodiscard]] virtual bool wants_published() const noexcept = 0;
  virtual void published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                         std::span<const std::byte> bytes) noexcept = 0;
  // Pipeline thread: a frame was not published because the publisher's ring was full.
  RT_SAFE virtual void unpublished(std::uint32_t stream) noexcept = 0;

  // Control thread, before the command that names the model: keeps the bytes of a model file under
  // their SHA-256. Cold: allocates and locks.
  virtual void keep_model(std::span<const std::byte> bytes) = 0;

  // Any cold thread: marks the beginning or the end of a take, behind the last chunk that was read
  // before the newest one. Returns the take that began or ended. Allocates and locks.
  virtual Result<Take> mark_take(const TakeMark& mark) = 0;

  // Reader thread: whether the recorder has taken so much that a source that can wait may go on;
  // otherwise records of the source or of the stream would soon be lost.
  RT_SAFE [[nodiscard]] virtual bool keeps_up(std::uint32_t source,
                                              std::uint32_t stream) const noexcept = 0;
};

}  // namespace posed::pipeline
