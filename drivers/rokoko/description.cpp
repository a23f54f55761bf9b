#include "drivers/rokoko/description.hpp"

#include <algorithm>
#include <bit>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "drivers/pose_values.hpp"

namespace posed::drivers::rokoko {
namespace {

// Writes little-endian numbers into bytes that are there. RT-safe.
class FixedWriter {
 public:
  explicit FixedWriter(std::span<std::byte> room) noexcept : room_(room) {}
  void number(std::uint64_t value, std::size_t bytes) noexcept {
    for (std::size_t i = 0; i < bytes; ++i) {
      room_[used_++] = static_cast<std::byte>(value >> 8 * i & 0xFFU);
    }
  }
  void text(std::string_view value) noexcept {
    for (const char c : value) room_[used_++] = static_cast<std::byte>(c);
  }
  [[nodiscard]] std::size_t used() const noexcept { return used_; }

 private:
  std::span<std::byte> room_;
  std::size_t used_ = 0;
};

std::unexpected<Error> wrong_description(const std::string& what) {
  return fail("the description of Studio's bodies " + what +
              "; posed wrote it, so the log that holds it is damaged: record it again");
}

Result<DescribedBody> read_described_body(ByteReader& reader) {
  DescribedBody body;
  const unsigned part = reader.u8();
  const unsigned face = reader.u8();
  const std::size_t size = reader.u8();
  const std::string_view name = reader.text(size);
  const std::uint64_t joints = reader.u64();
  if (!reader.ok()) return wrong_description("ends too early");
  if (part > static_cast<unsigned>(Part::kProp) || face > 1 || size > kMaxNameBytes) {
    return wrong_description("has a body of no known kind");
  }
  body.key.part = static_cast<Part>(part);
  body.key.name.keep(name);
  body.face = face == 1;
  body.joints = JointSet(joints);
  const bool person = body.key.part == Part::kPerson;
  const bool is_prop = body.key.part == Part::kProp;
  const bool known = joints >> kStudioJoints == 0 && connected(body.joints) == body.joints &&
                     (!is_prop || joints == 1) && (joints != 0 || (person && body.face));
  if (!known) return wrong_description("has a body without its joints");
  bool root = true;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    for (float& x_m : body.offset_m[j]) x_m = root ? 0.0F : reader.f32();
    root = false;
    if (!is_plausible(body.offset_m[j])) {
      return wrong_description("puts joint " + std::string(studio_joint(j).name) +
                               " out of the room");
    }
  }
  if (!reader.ok()) return wrong_description("ends too early");
  return body;
}

}  // namespace

RT_SAFE std::size_t write_body(const DescribedBody& body, std::span<std::byte> room) noexcept {
  FixedWriter writer(room);
  writer.number(static_cast<std::uint64_t>(body.key.part), 1);
  writer.number(body.face ? 1 : 0, 1);
  writer.number(body.key.name.text().size(), 1);
  writer.text(body.key.name.text());
  writer.number(body.joints.to_ullong(), 8);
  bool root = true;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    for (const float x_m : body.offset_m[j]) {
      if (!root) writer.number(std::bit_cast<std::uint32_t>(x_m), 4);
    }
    root = false;
  }
  return writer.used();
}

Result<std::vector<DescribedBody>> parse_description(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  const std::size_t count = reader.u8();
  if (!reader.ok()) return wrong_description("is empty");
  if (count > kMaxBodies) return wrong_description("has too many bodies");
  std::vector<DescribedBody> bodies;
  for (std::size_t i = 0; i < count; ++i) {
    auto body = TRY(read_described_body(reader));
    if (std::ranges::find(bodies, body.key, &DescribedBody::key) != bodies.end()) {
      return wrong_description("names a body twice");
    }
    bodies.push_back(body);
  }
  if (reader.left() != 0) return wrong_description("goes on after its last body");
  return bodies;
}

}  // namespace posed::drivers::rokoko
