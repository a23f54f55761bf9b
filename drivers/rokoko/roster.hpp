// Roster: the bodies in the stream, and their proportions. It says when they have to be described
// anew.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/rokoko/description.hpp"
#include "drivers/rokoko/studio_frame.hpp"

namespace posed::drivers::rokoko {

// A body within a frame.
struct SeenBody {
  BodyKey key;
  JointSet joints;  // seen in this frame; one skeleton can hold them
  bool face = false;
  const Subject* subject = nullptr;
};

inline constexpr std::size_t kMaxParts = 3;  // the most bodies of one subject

// The bodies that a subject is: a person, or the two hands of one without a body; none for a
// subject without data. Returns how many.
RT_SAFE [[nodiscard]] std::size_t bodies_of(const Subject& subject,
                                            std::array<SeenBody, kMaxParts>& bodies) noexcept;

class Roster {
 public:
  // Takes a body of the frame that came at `arrival_ns`. False when there is no room for it.
  RT_SAFE [[nodiscard]] bool accept(const SeenBody& body, std::int64_t arrival_ns) noexcept;

  // The description, after all bodies of a frame: empty unless it changed, and at most once in
  // kDescribeEvery_ns.
  RT_SAFE [[nodiscard]] std::span<const std::byte> describe(std::int64_t arrival_ns) noexcept;

 private:
  static constexpr std::int64_t kDescribeEvery_ns = kNanosPerSecond / 4;
  // A body or joint that is not seen for so long is gone; proportions that differ for so long in
  // every frame have changed.
  static constexpr std::int64_t kSettled_ns = kNanosPerSecond;

  struct Entry {
    bool used = false;
    DescribedBody body;
    std::int64_t seen_ns = 0, face_ns = 0;
    std::array<std::int64_t, kStudioJoints> joint_ns{};  // [joint] when it was seen last
    bool differs = false;                                // the proportions, since differs_ns
    std::int64_t differs_ns = 0;
  };
  [[nodiscard]] Entry* entry_of(const BodyKey& key) noexcept;
  // Describes the body by this frame.
  void measure(const SeenBody& seen, Entry& entry) noexcept;

  std::array<Entry, kMaxBodies> entries_;
  std::array<std::byte, kMaxDescriptionBytes> bytes_{};
  bool changed_ = false, described_ = false;
  std::int64_t described_ns_ = 0;
};

}  // namespace posed::drivers::rokoko
