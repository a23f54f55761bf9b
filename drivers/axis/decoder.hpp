// Decodes an Axis stream: one Frame for each message of an avatar that the layout names. The
// streams do not describe their avatars, so the decoder does, whenever they change.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/axis/description.hpp"
#include "drivers/axis/message_reader.hpp"
#include "drivers/axis/roster.hpp"
#include "drivers/driver.hpp"

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
