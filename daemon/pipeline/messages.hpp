// What crosses between the daemon's threads. Everything is trivially copyable and travels through
// boost::lockfree::spsc_queue rings by value.
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

// Words for people that cross a ring by value: as much of them as fits. RT-safe.
class ShortText {
 public:
  ShortText() = default;
  explicit ShortText(std::string_view text) noexcept { add(text); }

  void add(std::string_view text) noexcept {
    std::size_t fits = std::min(text.size(), bytes_.size() - size_);
    cut_ = cut_ || fits < text.size();
    while (fits > 0 && fits < text.size() && (text[fits] & 0xc0) == 0x80) --fits;  // whole UTF-8
    std::copy_n(text.begin(), fits, bytes_.begin() + size_);
    size_ = static_cast<std::uint8_t>(size_ + fits);
  }
  [[nodiscard]] std::string_view text() const noexcept { return {bytes_.data(), size_}; }
  [[nodiscard]] bool cut() const noexcept { return cut_; }  // there was more

 private:
  std::array<char, 94> bytes_{};
  std::uint8_t size_ = 0;
  bool cut_ = false;
};

// What a KIND_CONTROL event is about.
enum class Change : std::uint8_t { kAlpha, kStyleModel, kGestureModel, kStopPlaying };

// Something that happened to a stream, on its way to event/<stream>.
struct StreamEvent {
  std::uint32_t stream;
  std::uint8_t kind;  // posed.v1.Event.Kind
  std::int64_t time_ns;
  std::uint64_t sequence;
  double value;
  std::uint64_t ticket = 0;  // of the command that it answers; 0: nobody asked
  // What was changed from what into what, so that it can be told.
  Change change = Change::kAlpha;  // of KIND_CONTROL
  float alpha_before = 0.0F;    // kAlpha: where alpha was going until now; `value` is the new one
  ShortText before{}, after{};  // models' and calibrations' names, labels to be performed
};

// reader -> pipeline -> publisher
struct Item {
  enum class Kind : std::uint8_t { kFrame, kRawFrame, kSample, kEvent };
  Kind kind = Kind::kFrame;
  // Its place among everything that its reader handed over: frames, samples and events of all
  // streams, from 1. What found no room used up its number, too. 0: an engine made it.
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

// Commands of both kinds that may be under way: sent, and their Ack not yet taken by control.
inline constexpr std::size_t kMaxUnderWay = 64;

// Where the numbering stands: what comes next of a stream, and of its reader, gets these numbers.
struct Position {
  std::uint64_t frame = 1;   // Header::sequence of the stream's next frame
  std::uint64_t sample = 1;  // Header::sequence of the stream's next sample
  std::uint64_t item = 1;    // Item::number of the reader's next item, whatever its stream
};

// control -> pipeline; takes effect at the next frame boundary of its stream.
struct Command {
  enum class Kind : std::uint8_t { kAlpha, kModel, kGesture, kPlay, kStopPlaying };
  Kind kind = Kind::kAlpha;
  std::uint32_t stream = 0;
  std::uint64_t ticket = 0;  // comes back in the Ack; 0: nobody waits for one
  float alpha = 0.0F;
  const style::BoundModel* model = nullptr;       // kModel: ready-made; the cold side owns it
  const generate::BoundModel* gesture = nullptr;  // kGesture: the same
  std::array<char, 65> model_hash{};              // SHA-256 hex of the file's bytes, for the log
  gesture::PlayOrder play{};                      // kPlay
};
static_assert(std::is_trivially_copyable_v<Command>);

// control -> reader: what a device or its decoder is told.
struct DeviceCommand {
  enum class Kind : std::uint8_t { kCalibrate, kSend };
  Kind kind = Kind::kSend;
  std::uint32_t stream = 0;
  std::uint64_t ticket = 0;  // kCalibrate: comes back in the Ack
  const drivers::glove::OwnedCalibration* calibration = nullptr;  // the cold side owns it
  std::uint16_t size = 0;                                         // kSend
  std::array<std::byte, 256> bytes{};
};
static_assert(std::is_trivially_copyable_v<DeviceCommand>);

// pipeline -> control: the command has taken effect; what it replaced is no longer read.
struct Ack {
  std::uint64_t ticket = 0;
  std::uint32_t stream = 0;
  std::uint64_t sequence = 0;  // first frame that felt it
  bool refused = false;        // a play for which there was no room; nothing happened
};

// pipeline -> recorder: every decision that decoding alone cannot repeat. It takes effect just
// before the item `item` of the reader, whatever stream that item belongs to; so the decisions of
// all streams have one order, which is their order in the ring. What was dropped or shed is told
// when the engine meets the gap, after the fact: kShed and kShedSamples name the sequences that
// never reached it.
struct Decision {
  enum class Kind : std::uint8_t {
    kAlpha = 1,
    kModel = 2,
    kShed = 3,
    kTick = 4,
    kGesture = 5,
    kPlay = 6,
    kStopPlaying = 7,
    kEnd = 8,         // the source gives no more; what waits in the stages has gone out
    kShedSamples = 9  // as kShed, for samples
  };
  Kind kind = Kind::kAlpha;
  std::uint32_t stream = 0;
  std::uint64_t item = 0;      // filled in by the worker; engines do not know it
  std::uint64_t sequence = 0;  // next frame of the stream; kShed, kShedSamples: the first skipped
  std::uint64_t count = 0;     // kShed, kShedSamples: how many
  std::int64_t now_ns = 0;     // kTick, kEnd
  float alpha = 0.0F;
  std::array<char, 65> model_hash{};
  gesture::PlayOrder play{};  // kPlay
};

}  // namespace posed::pipeline
