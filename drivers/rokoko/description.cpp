#include "drivers/rokoko/description.hpp"

#include <algorithm>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "drivers/packer.hpp"
#include "drivers/pose_values.hpp"

namespace posed::drivers::rokoko {
namespace {

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
  Packer writer(room);
  writer.number(static_cast<std::uint64_t>(body.key.part), 1);
  writer.number(body.face ? 1 : 0, 1);
  writer.counted(body.key.name.text());
  writer.number(body.joints.to_ullong(), 8);
  bool root = true;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    for (const float x_m : body.offset_m[j]) {
      if (!root) writer.f32(x_m);
    }
    root = false;
  }
  return writer.size();
}

Result<std::vector<DescribedBody>> parse_description(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  const std::size_t count = reader.u8();
  if (!reader.ok()) return wrong_description("is empty");
  if (count == kOnlyNamedJoints) {
    return fail(
        "Rokoko Studio sends JSON v4, whose lists of joints posed does not read; choose JSON v3 in "
        "Studio's live stream");
  }
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
