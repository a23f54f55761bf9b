// The messages between the daemon's threads. All are trivially copyable and travel by value through
// boost::lockfree::spsc_queue rings.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "drivers/glove/calibration_file.hpp"
#include "models/generate/bound_model.hpp"
#include "models/gesture/play_order.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/frame.hpp"

namespace posed::pipeline {

// Short human-readable text that travels through a ring by value; longer text is cut. RT-safe.
class ShortText {
 public:
  ShortText() = default;
  explicit ShortText(std::string_view text) noexcept { add(text); }

  void add(std::string_view text) noexcept {
    std::size_t fits = std::min(text.size(), bytes_.size() - size_);
    cut_ = cut_ || fits < text.size();
    // never split a UTF-8 character
    while (fits > 0 && fits < text.size() && (text[fits] & 0xc0) == 0x80) --fits;
    std::copy_n(text.begin(), fits, bytes_.begin() + size_);
    size_ = static_cast<std::uint8_t>(size_ + fits);
  }
  [[nodiscard]] std::string_view text() const noexcept { return {bytes_.data(), size_}; }
  [[nodiscard]] bool cut() const noexcept { return cut_; }  // the text was longer

 private:
  std::array<char, 94> bytes_{};
  std::uint8_t size_ = 0;
  bool cut_ = false;
};

// What a KIND_CONTROL event changed.
enum class Change : std::uint8_t { kAlpha, kStyleModel, kGestureModel, kStopPlaying };

// Something that happened to a stream; published on event/<stream>.
struct StreamEvent {
  std::uint32_t stream;
  std::uint8_t kind;  // posed.v1.Event.Kind
  std::int64_t time_ns;
  std::uint64_t sequence;
  double value;
  std::uint64_t ticket = 0;  // of the command that caused it; 0 if no reply is expected
  // The old and the new value, so that the event can name both.
  Change change = Change::kAlpha;  // of KIND_CONTROL
  float alpha_before = 0.0F;       // kAlpha: the previous target; `value` is the new one
  ShortText before{}, after{};     // names of models and calibrations, labels to perform
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

// RT-safe.
[[nodiscard]] inline std::uint32_t stream_of(const Item& item) noexcept {
  if (item.kind == Item::Kind::kEvent) return item.stream_event.stream;
  return item.kind == Item::Kind::kSample ? item.sample.header.stream : item.frame.header.stream;
}

// How many commands of both kinds may be under way, that is, sent while control has not yet taken
// their Ack.
inline constexpr std::size_t kMaxUnderWay = 64;

// The numbers that the next frame and sample of a stream, and the next item of its reader, will
// get.
struct Position {
  std::uint64_t frame = 1;   // Header::sequence of the stream's next frame
  std::uint64_t sample = 1;  // Header::sequence of the stream's next sample
  std::uint64_t item = 1;    // Item::number of the reader's next item, whatever its stream
};

// control -> pipeline. It takes effect at the next frame boundary of its stream.
struct Command {
  enum class Kind : std::uint8_t { kAlpha, kModel, kGesture, kPlay, kStopPlaying };
  Kind kind = Kind::kAlpha;
  std::uint32_t stream = 0;
  std::uint64_t ticket = 0;  // returned in the Ack; 0 if no Ack is expected
  float alpha = 0.0F;
  // kModel: bound and ready to use; owned by the cold side
  const style::BoundModel* model = nullptr;
  const generate::BoundModel* gesture = nullptr;  // kGesture: the same
  std::array<char, 65> model_hash{};              // SHA-256 hex of the file's bytes, for the log
  gesture::PlayOrder play{};                      // kPlay
};
static_assert(std::is_trivially_copyable_v<Command>);

// control -> reader: a command for a device or its decoder.
struct DeviceCommand {
  enum class Kind : std::uint8_t { kCalibrate, kSend };
  Kind kind = Kind::kSend;
  std::uint32_t stream = 0;
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
  bool refused = false;  // a play order that did not fit into the queue of labels; nothing changed
};

// pipeline -> recorder: a decision that cannot be derived from the recorded bytes alone, so replay
// must read it from the log. It takes effect just before the reader's item `item`, whatever stream
// that item belongs to; so the decisions of all streams have one order, which is their order in the
// ring. Dropped and shed frames are recorded only when the engine meets the gap: kShed and
// kShedSamples name the sequences that never reached it.
struct Decision {
  enum class Kind : std::uint8_t {
    kAlpha = 1,
    kModel = 2,
    kShed = 3,
    kTick = 4,
    kGesture = 5,
    kPlay = 6,
    kStopPlaying = 7,
    kEnd = 8,         // the source has ended; the stages have emitted what they held back
    kShedSamples = 9  // like kShed, for samples
  };
  Kind kind = Kind::kAlpha;
  std::uint32_t stream = 0;
  std::uint64_t item = 0;  // set by the worker; engines do not know it
  // the stream's next frame; kShed, kShedSamples: the first one skipped
  std::uint64_t sequence = 0;
  std::uint64_t count = 0;  // kShed, kShedSamples: how many were skipped
  std::int64_t now_ns = 0;  // kTick, kEnd
  float alpha = 0.0F;
  std::array<char, 65> model_hash{};
  gesture::PlayOrder play{};  // kPlay
};

}  // namespace posed::pipeline
