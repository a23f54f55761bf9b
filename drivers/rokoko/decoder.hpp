// Decodes each datagram of Rokoko Studio: one frame for each body that the layout names, a sample
// for each face. Bodies that come, go or change are described before their frames.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/rokoko/description.hpp"
#include "drivers/rokoko/studio_frame.hpp"
#include "drivers/timestamp_clock.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::rokoko {

// The bodies of a Studio stream, compiled from the decoder's description.
// Says from which joints of the stream a skeleton is made.
struct BodyPlan {
  BodyKey key;
  std::vector<std::uint8_t> joint;  // [joint of the skeleton] joint of joints.hpp
  bool face = false;
};

class StudioLayout final : public SourceLayout {
 public:
  std::vector<BodyPlan> plans;  // [body]

  // The index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(const BodyKey& key) const noexcept;
};

// The skeleton of a body as it was described; null for one with only a face. Cold.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                    const std::string& name);

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

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

// The bodies in the stream, and their proportions. It says when they have to be described anew.
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

class StudioDecoder final : public LayoutDecoder<StudioLayout> {
 public:
  // Takes one datagram per call.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  static constexpr std::size_t kMaxJson = 256 * 1024;  // bytes that a datagram may unpack to

  [[nodiscard]] Outcome read(std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] Outcome accept_frame(std::int64_t received_ns, Sink& sink) noexcept;
  // Emits one body if it fits the layout.
  [[nodiscard]] Outcome emit(const SeenBody& seen, Sink& sink) noexcept;
  void emit_face(std::size_t body, const Subject& subject, Sink& sink) noexcept;

  ActiveTime active_time_;
  TimestampClock clock_;
  StudioFrame frame_;
  Roster roster_;
  bool told_named_joints_ = false;
  std::bitset<kMaxBodies> taken_;  // bodies of the frame so far
  std::array<std::byte, kMaxJson> json_{};
};

// An LZ4 frame (lz4's doc/lz4_Frame_format.md) into a buffer of fixed size. LZ4F_decompress
// allocates when it sees a frame's head, so the head and the blocks are read here, and liblz4
// decompresses each block.

// True for bytes that begin with the frame's magic number 04 22 4D 18.
RT_SAFE [[nodiscard]] bool is_lz4_frame(std::span<const std::byte> bytes) noexcept;

// kOk: `content` is the part of `room` that holds the content. kOutOfRange: it does not fit.
// kBadChecksum: of the head, a block or the content. kShort: cut, damaged, or goes on after its
// end. kForeign: another version of the format, or one that needs a dictionary.
RT_SAFE [[nodiscard]] Outcome decode_lz4_frame(std::span<const std::byte> bytes,
                                               std::span<std::byte> room,
                                               std::span<const std::byte>& content) noexcept;

}  // namespace posed::drivers::rokoko
