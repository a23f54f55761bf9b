#include "drivers/axis/description.hpp"

#include <algorithm>

#include "drivers/byte_reader.hpp"
#include "drivers/packer.hpp"
#include "drivers/pose_values.hpp"

namespace posed::drivers::axis {
namespace {

constexpr unsigned kReference = 1;
constexpr unsigned kMeasured = 2;
constexpr unsigned kPro = 4;
constexpr unsigned kStudio = 8;
constexpr float kMetre_cm = 100.0F;

std::unexpected<Error> wrong(const std::string& what) {
  return fail("the list of avatars " + what +
              "; the log is damaged or was made by another version of posed");
}

Result<AvatarEntry> read_entry(ByteReader& reader) {
  AvatarEntry entry;
  const std::uint32_t number = reader.u32();
  const unsigned flags = reader.u8();
  entry.avatar = make_avatar(number, reader.text(kNameBytes));
  entry.reference = (flags & kReference) != 0;
  entry.measured = (flags & kMeasured) != 0;
  if (!reader.ok()) return wrong("ends too early");
  const bool two_figures = (flags & kPro) != 0 && (flags & kStudio) != 0;
  if (number > kMaxAvatar || two_figures || flags > (kReference | kMeasured | kPro | kStudio)) {
    return wrong("has an avatar that cannot be");
  }
  if ((flags & kPro) != 0) entry.figure = Figure::kPro;
  if ((flags & kStudio) != 0) entry.figure = Figure::kStudio;
  entry.offset_cm = default_proportions(figure_of(entry));
  for (std::size_t b = 1; b < kBones && entry.measured; ++b) {
    for (float& x_cm : entry.offset_cm[b]) x_cm = reader.f32();
    Vec3f offset_m = entry.offset_cm[b];
    for (float& x : offset_m) x /= kMetre_cm;
    if (!is_plausible(offset_m))
      return wrong("puts bone " + bone_name(b, figure_of(entry)) + " out of the room");
  }
  if (!reader.ok()) return wrong("ends too early");
  return entry;
}

RT_SAFE unsigned flags_of(const AvatarEntry& entry) noexcept {
  unsigned flags = (entry.reference ? kReference : 0) | (entry.measured ? kMeasured : 0);
  if (entry.figure) flags |= *entry.figure == Figure::kStudio ? kStudio : kPro;
  return flags;
}

}  // namespace

Figure figure_of(const AvatarEntry& entry) noexcept {
  if (entry.figure) return *entry.figure;
  return entry.measured ? figure_with(entry.offset_cm) : Figure::kPro;
}

RT_SAFE std::size_t write_list_head(std::uint8_t order, std::size_t avatars,
                                    std::span<std::byte> out) noexcept {
  Packer packer(out);
  packer.number(order, 1);
  packer.number(avatars, 1);
  return packer.size();
}

RT_SAFE std::size_t write_entry(const AvatarEntry& entry, std::span<std::byte> out) noexcept {
  Packer packer(out);
  packer.number(entry.avatar.number, 4);
  packer.number(flags_of(entry), 1);
  packer.text(entry.avatar.name);
  for (std::size_t b = 1; b < kBones && entry.measured; ++b) {
    for (const float x_cm : entry.offset_cm[b]) packer.f32(x_cm);
  }
  return packer.size();
}

Result<AvatarList> parse_list(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  AvatarList list;
  list.order = reader.u8();
  const std::size_t count = reader.u8();
  if (!reader.ok()) return wrong("ends too early");
  if (list.order >= kOrderNames.size()) return wrong("has an unknown order of rotations");
  if (count > kMaxBodies) {
    return wrong("has " + std::to_string(count) + " avatars, more than " +
                 std::to_string(kMaxBodies));
  }
  for (std::size_t i = 0; i < count; ++i) {
    auto entry = TRY(read_entry(reader));
    if (std::ranges::find(list.avatars, entry.avatar, &AvatarEntry::avatar) != list.avatars.end()) {
      return wrong("has an avatar twice");
    }
    list.avatars.push_back(entry);
  }
  if (reader.left() != 0) return wrong("goes on after its last avatar");
  return list;
}

std::array<Axis, 3> order_axes(std::uint8_t order) {
  std::array<Axis, 3> axes{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i] = static_cast<Axis>(kOrderNames[order][i] - 'X');
  }
  return axes;
}

}  // namespace posed::drivers::axis
