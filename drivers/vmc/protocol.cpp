#include "drivers/vmc/protocol.hpp"

#include "drivers/byte_reader.hpp"
#include "drivers/packer.hpp"
#include "drivers/pose_values.hpp"

namespace posed::drivers::vmc {
namespace {

constexpr std::uint8_t kVersion = 1;

std::unexpected<Error> wrong(const std::string& what) {
  return fail("the description of the VMC performer " + what +
              "; the log that it comes from is damaged");
}

Result<> read_bones(ByteReader& reader, Described& described) {
  const std::size_t bones = reader.u8();
  std::size_t least = 0;
  for (std::size_t i = 0; i < bones; ++i) {
    const std::size_t bone = reader.u8();
    Vec3f offset_m{};
    for (float& x_m : offset_m) x_m = reader.f32();
    if (!reader.ok()) return wrong("ends too early");
    if (bone < least || bone >= kBoneCount) {
      return wrong("has a wrong bone " + std::to_string(bone));
    }
    least = bone + 1;
    if (!is_plausible(offset_m)) return wrong("puts a bone out of the room");
    described.bones.set(bone);
    described.offset_m[bone] = offset_m;
  }
  return {};
}

Result<> read_values(ByteReader& reader, Described& described) {
  const std::size_t entries = reader.u8();
  std::size_t values = 0;
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t kind = reader.u8();
    const std::string_view name = reader.text(reader.u8());
    if (!reader.ok()) return wrong("ends too early");
    if (kind >= kValueKinds) return wrong("has a value of unknown kind");
    if (name.empty() || name.size() > kMaxVmcName) return wrong("has a name of wrong length");
    const Described::Value value{static_cast<ValueKind>(kind), name};
    values += values_of(value.kind);
    if (values > kMaxVmcValues) return wrong("has too many values");
    described.values[described.value_count++] = value;
  }
  return {};
}

}  // namespace

RT_SAFE std::span<const std::byte> write_description(
    const Described& described, std::array<std::byte, kMaxDescribed>& room) noexcept {
  Packer writer(room);
  writer.u8(kVersion);
  writer.counted(described.title);
  writer.u8(described.bones.count());
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (!described.bones[bone]) continue;
    writer.u8(bone);
    for (const float x_m : described.offset_m[bone]) writer.f32(x_m);
  }
  writer.u8(described.value_count);
  for (const Described::Value& value : std::span(described.values).first(described.value_count)) {
    writer.u8(static_cast<std::size_t>(value.kind));
    writer.counted(value.name);
  }
  return writer.written();
}

Result<Described> parse_description(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  Described described;
  if (reader.u8() != kVersion) return wrong("is of another version");
  described.title = reader.text(reader.u8());
  if (!reader.ok() || described.title.size() > kMaxVmcName) return wrong("has a wrong title");
  TRY(read_bones(reader, described));
  TRY(read_values(reader, described));
  if (!reader.ok()) return wrong("ends too early");
  if (reader.left() != 0) return wrong("goes on after its end");
  return described;
}

}  // namespace posed::drivers::vmc
