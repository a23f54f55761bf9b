#include "drivers/mvn/layout.hpp"

#include <algorithm>
#include <bitset>

#include "drivers/byte_reader.hpp"
#include "drivers/packer.hpp"
#include "drivers/pose_values.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr std::uint8_t kDescriptionVersion = 1;
constexpr std::uint8_t kWithFingers = 1;
constexpr std::uint8_t kMaxFlags = (1U << (1 + kValueGroups)) - 1;

std::unexpected<Error> mvn_wrong(const std::string& what) {
  return fail("the description of the MVN characters " + what +
              "; it was written by posed, so its log or its copy is damaged");
}

Result<Character> read_character(ByteReader& reader) {
  Character character;
  character.id = reader.u8();
  const std::uint8_t flags = reader.u8();
  character.fingers = (flags & kWithFingers) != 0;
  character.values = ValueGroups(flags >> 1);
  character.name_bytes = reader.u8();
  if (flags > kMaxFlags || character.name_bytes > kMvnNameBytes) {
    return mvn_wrong("has a character that makes no sense");
  }
  const std::string_view name = reader.text(character.name_bytes);
  std::ranges::copy(name, character.name.begin());
  for (std::size_t i = 0; i < character.segments(); ++i) {
    for (float& x_m : character.offset_m[i]) x_m = reader.f32();
    if (!is_plausible(character.offset_m[i])) return mvn_wrong("has a segment out of the room");
  }
  if (!reader.ok()) return mvn_wrong("ends too early");
  return character;
}

}  // namespace

std::size_t write_description_head(std::size_t characters, std::span<std::byte> to) noexcept {
  Packer writer(to);
  writer.u8(kDescriptionVersion);
  writer.u8(characters);
  return writer.size();
}

std::size_t write_character(const Character& character, std::span<std::byte> to) noexcept {
  Packer writer(to);
  writer.u8(character.id);
  writer.u8((character.fingers ? kWithFingers : 0U) | character.values.to_ulong() << 1);
  writer.counted(std::span(character.name).first(character.name_bytes));
  for (std::size_t i = 0; i < character.segments(); ++i) {
    for (const float x_m : character.offset_m[i]) writer.f32(x_m);
  }
  return writer.size();
}

std::size_t MvnLayout::body_of(std::uint8_t character) const noexcept {
  return std::ranges::find(entries, character, &Entry::character) - entries.begin();
}

std::string body_name(const Character& character) {
  const std::string name = clean_name({character.name.data(), character.name_bytes});
  return name.empty() ? "character-" + std::to_string(character.id) : name;
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const Character& character) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = body_name(character);
  const JointTable& table = joint_table(character.fingers);
  for (std::size_t j = 0; j < table.count; ++j) {
    const std::size_t segment = table.segment[j];
    const Vec3f& offset_m = character.offset_m[segment];
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = segment_name(segment);
    joint.parent = table.parent[j];
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
    joint.bone = segment_bone(segment);  // in T-pose no segment is turned, so T is identity
  }
  TRY(skeleton->finish());
  return skeleton;
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  ByteReader reader(description);
  const std::uint8_t version = reader.u8();
  const std::size_t count = reader.u8();
  if (!reader.ok()) return mvn_wrong("is empty");
  if (version != kDescriptionVersion) return mvn_wrong("is not of this version of posed");
  if (count > kMaxCharacters) return mvn_wrong("has too many characters");
  auto layout = std::make_unique<MvnLayout>();
  std::bitset<256> seen;
  for (std::size_t i = 0; i < count; ++i) {
    const auto character = TRY(read_character(reader));
    if (seen[character.id]) return mvn_wrong("has the same character twice");
    seen.set(character.id);
    auto skeleton = TRY(skeleton_of(character));
    Body& body = layout->bodies.emplace_back();
    body.name = body_name(character);
    body.skeleton = std::move(skeleton);
    body.samples = name_values(character.values);
    layout->entries.push_back({.character = character.id,
                               .fingers = character.fingers,
                               .groups = character.values,
                               .values = place_values(character.values)});
  }
  if (reader.left() != 0) return mvn_wrong("goes on after its last character");
  return layout;
}

}  // namespace posed::drivers::mvn
