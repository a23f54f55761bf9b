// Decodes an Axis stream: one Frame for each message of an avatar that the layout names. The
// streams do not describe their avatars, so the decoder does, whenever they change.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/axis/description.hpp"
#include "drivers/axis/protocol.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/unrolled_counter.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::axis {

// The avatars of an Axis stream as bodies, compiled from the decoder's own description.
class AxisLayout final : public SourceLayout {
 public:
  struct Known {
    Avatar avatar;
    bool reference = false;
  };
  std::vector<Known> known;  // [body]

  // The index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(const Avatar& avatar) const noexcept;
};

// The skeleton of an avatar, "Reference" above the hips if the stream has it. The joints have the
// stream's rotation channels; reference and hips also have positions. Cold.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const AvatarEntry& entry, std::uint8_t order);

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

// The settings that only the options say, because the streams do not.
struct StreamSettings {
  std::uint8_t order = 0;          // of the rotations, an index of kOrderNames
  bool datagrams = false;          // over UDP, where messages come late or twice
  double rate_hz = 0.0;            // of the frame numbers; 0: unknown
  std::optional<Figure> figure{};  // nullopt: as the lengths of the bones say
};

// One avatar in the stream.
struct Present {
  AvatarEntry entry;
  DatagramOrder order{32};
  UnrolledCounter counter{32};
  // The stream's frames before the newest message, by its frame number: one clock for all avatars,
  // also for those that come later or return.
  std::int64_t tick = 0;
  std::int64_t first_tick = 0;  // when the avatar appeared
  bool used = false;

  std::int64_t seen_ns = 0;              // when its last message arrived
  std::int64_t differs_ns = kNoTime_ns;  // since when its proportions have been others
};

// The avatars that are in a stream now, with their proportions as they were described. It says when
// they have changed enough to be described again.
class Roster {
 public:
  // `order` of the rotations, an index of kOrderNames; `figure` that the options say.
  Roster(std::uint8_t order, std::optional<Figure> figure) noexcept
      : order_(order), figure_(figure) {}

  // The place of an avatar, a new one if needed; null when all are taken.
  RT_SAFE [[nodiscard]] Present* find(const Avatar& avatar) noexcept;

  // Stores a valid message of it.
  RT_SAFE void see(Present& present, const Message& message, std::int64_t now_ns) noexcept;

  // Forgets avatars that are gone. Returns the list of the others if it is not as described before,
  // at most twice a second, otherwise nothing.
  RT_SAFE [[nodiscard]] std::span<const std::byte> news(std::int64_t now_ns) noexcept;

 private:
  void count_frames(Present& present, std::uint32_t frame_number) noexcept;
  void measure(Present& present, const Message& message, std::int64_t now_ns) noexcept;
  void forget_gone(std::int64_t now_ns) noexcept;

  std::uint8_t order_;
  std::optional<Figure> figure_;
  std::array<Present, kMaxBodies> all_;
  std::int64_t newest_tick_ = 0;  // of all avatars
  bool changed_ = false;
  bool described_ = false;         // at least once
  std::int64_t described_ns_ = 0;  // when
  std::int64_t received_ns_ = 0;   // when the last message of any avatar arrived
  std::array<std::byte, kListHeadBytes + kMaxBodies * kMaxEntryBytes> list_{};
};

// Receives what a MessageReader finds. RT-safe.
class Messages {
 public:
  Messages() = default;
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  virtual ~Messages() = default;

  // Receives a whole message. The callee counts it, unless `in_damage` is set and it is not valid:
  // then it belongs to damage that was counted already. A binary one says whether it was valid.
  [[nodiscard]] virtual bool binary(std::span<const std::byte> bytes, bool in_damage) noexcept = 0;
  virtual void text(std::string_view text, bool in_damage) noexcept = 0;
  // Bytes that are no message; once for all until the next valid one.
  virtual void damage(Outcome outcome) noexcept = 0;
};

// MessageReader finds the messages in the bytes of an Axis stream, binary or text, from the bytes
// alone. Chunks may be cut anywhere: over TCP, and over UDP where some systems send a message in
// several datagrams (the first of 1024 bytes). After damage it goes on with the next message.
class MessageReader {
 public:
  RT_SAFE void feed(std::span<const std::byte> bytes, Messages& messages) noexcept;

 private:
  // Each returns false when more bytes are needed.
  [[nodiscard]] bool advance(Messages& messages) noexcept;
  [[nodiscard]] bool advance_binary(Messages& messages) noexcept;
  [[nodiscard]] bool advance_calculation(Messages& messages) noexcept;
  [[nodiscard]] bool advance_text(Messages& messages) noexcept;
  void count_damage(Outcome outcome, Messages& messages) noexcept;
  void drop(std::size_t count) noexcept;
  [[nodiscard]] std::span<const std::byte> pending() const noexcept {
    return std::span(buffer_).subspan(begin_, end_ - begin_);
  }

  std::array<std::byte, kMaxText> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  // of the pending bytes
  std::size_t scanned_ = 0;          // pending bytes of a text that were looked at
  bool in_damage_ = false;           // counted; no valid message since
  bool overlong_ = false;            // a text without end: discarded up to its end
};

class AxisDecoder final : public LayoutDecoder<AxisLayout>, private Messages {
 public:
  explicit AxisDecoder(const StreamSettings& settings) noexcept
      : settings_(settings), roster_(settings.order, settings.figure) {}

  // Takes bytes cut at any position.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  bool binary(std::span<const std::byte> bytes, bool in_damage) noexcept override;
  void text(std::string_view text, bool in_damage) noexcept override;
  void damage(Outcome outcome) noexcept override { sink_->outcome(outcome); }

  // Emits the frame of `message_`.
  [[nodiscard]] Outcome accept_message() noexcept;
  void emit_frame(std::size_t body, const Present& present) noexcept;

  StreamSettings settings_;
  MessageReader reader_;
  Roster roster_;
  Message message_;       // the current one
  Sink* sink_ = nullptr;  // of the current call of feed()
  std::int64_t now_ns_ = 0;
};

}  // namespace posed::drivers::axis
