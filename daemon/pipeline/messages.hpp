// The messages between the daemon's threads. All are trivially copyable and travel by value through
// boost::lockfree::spsc_queue rings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "drivers/glove/calibration_file.hpp"
#include "models/stage_type.hpp"
#include "proto/frame/frame.hpp"
#include "proto/text/short_text.hpp"

namespace posed::pipeline {

// A change to one stage of a stream: asked for by control, kept in the log, announced by an event.
struct StageChange {
  enum class Kind : std::uint8_t { kSet, kModel, kCommand };
  Kind kind = Kind::kSet;
  std::uint8_t index = 0;           // kSet: in StageType::parameters; kCommand: in ::commands
  const StageType* type = nullptr;  // of the stage, which the stream has at most once
  double value = 0.0;               // kSet; true and false are 1 and 0
};

// Something that happened to a stream; published on event/<stream>.
struct StreamEvent {
  std::uint32_t stream = 0;
  std::uint8_t kind = 0;  // posed.v1.Event.Kind
  std::int64_t time_ns = 0;
  std::uint64_t sequence = 0;
  double value = 0.0;
  std::uint64_t ticket = 0;  // of the command that caused it; 0 if no reply is expected
  // Of KIND_ENDED: the sequence of the last sample, if the event comes from the reader; and whether
  // the stream gives its slot back, because its body has left or changed. It keeps the slot if its
  // source has ended.
  std::uint64_t last_sample = 0;
  bool leaves = false;
  StageChange change{};  // of KIND_CONTROL and KIND_PLAYING
  // The old and the new value, so that the event can name both.
  double value_before = 0.0;    // StageChange::kSet: the target until now
  ShortText before{}, after{};  // names of models and calibrations; what a stage's command does
  std::string_view notice{};    // of a stage: the sentence in its StageType
};

// reader -> pipeline -> publisher
struct Item {
  enum class Kind : std::uint8_t { kFrame, kRawFrame, kSample, kEvent };
  Kind kind = Kind::kFrame;
  // The number of this item among everything that its reader handed over: frames, samples and
  // events of all streams, counted from 1. Items that were lost because a ring was full have used
  // up their number, too. 0: made by an engine.
  std::uint64_t number = 0;
  union {
    Frame frame;
    Sample sample;
    StreamEvent stream_event;
  };
  Item() noexcept : frame{} {}
};
static_assert(std::is_trivially_copyable_v<Item>);

RT_SAFE [[nodiscard]] inline std::uint32_t stream_of(const Item& item) noexcept {
  if (item.kind == Item::Kind::kEvent) return item.stream_event.stream;
  return item.kind == Item::Kind::kSample ? item.sample.header.stream : item.frame.header.stream;
}

// How many commands of both kinds may be under way, that is, sent while control has not yet taken
// their Ack.
inline constexpr std::size_t kMaxUnderWay = 64;

// Stream ids are generation << 16 | slot. Hot code finds a stream by its slot, of which there are
// as many as streams at once; the generation tells apart the streams that have the slot one after
// the other. Streams that are there from the start have generation 0.
[[nodiscard]] constexpr std::uint32_t slot_of(std::uint32_t stream) noexcept {
  return stream & 0xffff;
}
[[nodiscard]] constexpr std::uint32_t stream_id(std::uint32_t slot,
                                                std::uint32_t generation) noexcept {
  return generation << 16 | slot;
}
[[nodiscard]] constexpr std::uint32_t generation_of(std::uint32_t stream) noexcept {
  return stream >> 16;
}
inline constexpr std::uint32_t kMaxGeneration = 0xfffe;

// The id of no stream: of a body that nobody wants.
inline constexpr std::uint32_t kNoStream = 0xffff'ffff;

// The numbers that the next frame and sample of a stream will get.
struct StreamPosition {
  std::uint32_t stream = 0;
  std::uint64_t frame = 1;   // Header::sequence of its next frame
  std::uint64_t sample = 1;  // Header::sequence of its next sample
};

// The numbers that come next from a source. The span is valid until the source reads on.
struct Position {
  std::uint64_t item = 1;  // Item::number of the reader's next item, whatever its stream
  std::span<const StreamPosition> streams{};
};

// SHA-256 of a model file, in hex, with a closing zero.
using ModelHash = std::array<char, 65>;

// control -> pipeline. It takes effect at the next frame boundary of its stream.
struct Command {
  StageChange change{};
  std::uint32_t stream = 0;
  std::uint64_t ticket = 0;           // returned in the Ack; 0 if no Ack is expected
  const StageModel* model = nullptr;  // kModel: ready to use; owned by the cold side; null: none
  ModelHash model_hash{};             // kModel: for the log; empty: none
  StageCommand command{};             // kCommand
};
static_assert(std::is_trivially_copyable_v<Command>);

// control -> reader: a command for a device or its decoder.
struct DeviceCommand {
  enum class Kind : std::uint8_t { kCalibrate, kSend };
  Kind kind = Kind::kSend;
  std::uint32_t source = 0;                                       // its number
  std::uint64_t ticket = 0;                                       // kCalibrate: returned in the Ack
  const drivers::glove::OwnedCalibration* calibration = nullptr;  // owned by the cold side
  std::uint16_t size = 0;                                         // kSend
  std::array<std::byte, 256> bytes{};
};
static_assert(std::is_trivially_copyable_v<DeviceCommand>);

// pipeline -> control: the command has taken effect, and what it replaced is no longer read.
struct Ack {
  std::uint64_t ticket = 0;
  std::uint32_t stream = 0;
  std::uint64_t sequence = 0;  // the first frame to which it applied
  bool refused = false;        // the stage did not take the command; nothing changed
  bool gone = false;           // the worker does not have the stream (any more, or yet)
};

// pipeline -> recorder: a decision that cannot be derived from the recorded bytes alone, so replay
// must read it from the log. It takes effect just before the reader's item `item`, whatever stream
// that item belongs to; so the decisions of all streams have one order, which is their order in the
// ring. Dropped and shed frames are recorded only when the engine meets the gap: kShed and
// kShedSamples name the sequences that never reached it.
struct Decision {
  enum class Kind : std::uint8_t {
    kChange,
    kShed,
    kShedSamples,  // like kShed, for samples
    kTick,
    kEnd  // the source has ended; the stages have emitted what they held back
  };
  Kind kind = Kind::kTick;
  std::uint32_t stream = 0;
  std::uint64_t item = 0;  // set by the worker; engines do not know it
  // the stream's next frame; kShed, kShedSamples: the first one skipped
  std::uint64_t sequence = 0;
  std::uint64_t count = 0;  // kShed, kShedSamples: how many were skipped
  std::int64_t now_ns = 0;  // kTick, kEnd
  // Of kChange, as in the Command.
  StageChange change{};
  ModelHash model_hash{};
  StageCommand command{};
};

}  // namespace posed::pipeline
