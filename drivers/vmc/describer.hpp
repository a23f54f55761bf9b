// Describer: when the VMC performer has changed, and its description. The bones that were sent
// within a second and their positions are its skeleton; the names of its blend shapes and devices
// are its values.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/vmc/protocol.hpp"
#include "drivers/vmc/values.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::vmc {

// RT-safe.
class Describer {
 public:
  // The bones that an ended frame set, and all positions [bone].
  void frame(const std::bitset<kBoneCount>& bones, const std::array<Vec3f, kBoneCount>& position_m,
             std::int64_t arrival_ns) noexcept;
  // Sets the name that the sender gives its avatar. It is for people, so it alone makes no new
  // description.
  void title(std::string_view text) noexcept;

  // True when nothing has come for so long that the performer is gone.
  [[nodiscard]] bool is_gone(const Values& values, std::int64_t now_ns) const noexcept;

  // Describes the performer if it has changed and the change has lasted for some frames. Call it
  // after each frame and sample, and while none come.
  void update(Values& values, std::int64_t now_ns, Sink& sink) noexcept;

 private:
  static constexpr std::int64_t kGone_ns = kNanosPerSecond;
  static constexpr std::int64_t kBetween_ns = kNanosPerSecond / 2;  // descriptions
  // Between descriptions that only moved bones: doubled each time up to this, because each one
  // begins the stream again, and some avatars stretch.
  static constexpr std::int64_t kMaxInterval_ns = 64 * kNanosPerSecond;
  static constexpr float kMoved_m = 0.005F;
  static constexpr int kSteady = 2;  // frames without a new bone or value

  void forget_bones(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool has_moved() const noexcept;
  void describe(const Values& values, std::int64_t now_ns, Sink& sink) noexcept;

  std::bitset<kBoneCount> bones_;
  std::array<std::int64_t, kBoneCount> last_ns_{};
  std::array<Vec3f, kBoneCount> offset_m_{};
  std::array<char, kMaxVmcName> title_{};
  std::size_t title_size_ = 0;
  bool grown_ = false;       // a bone has come since the last update
  bool values_new_ = false;  // a value has come since the last description
  int steady_ = 0;           // updates without a new bone or value
  Described described_;      // last; its texts are not used
  bool there_ = false;       // the last description has a performer
  std::int64_t described_ns_ = kNoTime_ns;
  std::int64_t between_moves_ns_ = kBetween_ns;
  std::array<std::byte, kMaxDescribed> bytes_{};
};

}  // namespace posed::drivers::vmc
