#include "drivers/mocopi/protocol.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace posed::drivers::mocopi {
namespace {

struct BoneRow {
  std::string_view name;
  std::uint16_t parent;
  std::optional<Bone> bone;
};

// Names and numbers: the table of Sony's plugin for Unity and two receivers agree. Which bones they
// are: Sony's plugin, from what a receiver says about it.
constexpr std::array<BoneRow, kBones> kRows{{{"root", kNoParent, Bone::kHips},
                                             {"torso_1", 0, {}},
                                             {"torso_2", 1, {}},
                                             {"torso_3", 2, Bone::kSpine},
                                             {"torso_4", 3, {}},
                                             {"torso_5", 4, Bone::kChest},
                                             {"torso_6", 5, Bone::kUpperChest},
                                             {"torso_7", 6, {}},
                                             {"neck_1", 7, Bone::kNeck},
                                             {"neck_2", 8, {}},
                                             {"head", 9, Bone::kHead},
                                             {"l_shoulder", 7, Bone::kLeftShoulder},
                                             {"l_up_arm", 11, Bone::kLeftUpperArm},
                                             {"l_low_arm", 12, Bone::kLeftLowerArm},
                                             {"l_hand", 13, Bone::kLeftHand},
                                             {"r_shoulder", 7, Bone::kRightShoulder},
                                             {"r_up_arm", 15, Bone::kRightUpperArm},
                                             {"r_low_arm", 16, Bone::kRightLowerArm},
                                             {"r_hand", 17, Bone::kRightHand},
                                             {"l_up_leg", 0, Bone::kLeftUpperLeg},
                                             {"l_low_leg", 19, Bone::kLeftLowerLeg},
                                             {"l_foot", 20, Bone::kLeftFoot},
                                             {"l_toes", 21, Bone::kLeftToes},
                                             {"r_up_leg", 0, Bone::kRightUpperLeg},
                                             {"r_low_leg", 23, Bone::kRightLowerLeg},
                                             {"r_foot", 24, Bone::kRightFoot},
                                             {"r_toes", 25, Bone::kRightToes}}};

// The field of this name inside a value; false when it is not there.
RT_SAFE bool find_field(std::span<const std::byte> within, std::string_view wanted,
                        std::span<const std::byte>& value) noexcept {
  FieldReader fields(within);
  std::string_view name;
  while (fields.next(name, value)) {
    if (name == wanted) return true;
  }
  return false;
}

RT_SAFE bool is_head(std::span<const std::byte> head) noexcept {
  std::span<const std::byte> format, version;
  if (!find_field(head, "ftyp", format) || !find_field(head, "vrsn", version)) return false;
  const std::string_view text(reinterpret_cast<const char*>(format.data()), format.size());
  return text.starts_with(kFormat) && version.size() == 1 &&
         std::to_integer<int>(version[0]) == kFormatVersion;
}

std::unexpected<Error> wrong_skeleton(const std::string& what) {
  return fail("the skeleton that the mocopi app sends " + what + "; start its sending again");
}

}  // namespace

RT_SAFE bool FieldReader::next(std::string_view& name, std::span<const std::byte>& value) noexcept {
  if (reader_.left() == 0) return false;
  const std::uint32_t length = reader_.u32();
  name = reader_.text(4);
  value = reader_.bytes(length);
  return reader_.ok();
}

RT_SAFE Outcome decode_datagram(std::span<const std::byte> bytes, Datagram& datagram) noexcept {
  FieldReader fields(bytes);
  std::string_view name;
  std::span<const std::byte> value;
  if (!fields.next(name, value) || name != "head" || !is_head(value)) return Outcome::kForeign;
  bool found = false;
  while (fields.next(name, value)) {
    if (name != "skdf" && name != "fram") continue;
    datagram = {.kind = name == "skdf" ? Kind::kSkeleton : Kind::kFrame, .content = value};
    found = true;
  }
  if (!fields.ok()) return Outcome::kShort;
  return found ? Outcome::kOk : Outcome::kForeign;
}

RT_SAFE bool read_bone(std::span<const std::byte> value, bool with_parent,
                       BoneEntry& bone) noexcept {
  std::span<const std::byte> id, parent, numbers;
  if (!find_field(value, "bnid", id) || id.size() != 2) return false;
  if (!find_field(value, "tran", numbers) || numbers.size() != 28) return false;
  if (with_parent && (!find_field(value, "pbid", parent) || parent.size() != 2)) return false;
  bone.id = ByteReader(id).u16();
  bone.parent = with_parent ? ByteReader(parent).u16() : kNoParent;
  ByteReader reader(numbers);
  for (float& x : bone.transform.rotation_xyzw) x = reader.f32();
  for (float& x_m : bone.transform.position_m) x_m = reader.f32();
  return true;
}

RT_SAFE bool read_frame(std::span<const std::byte> content, FrameHead& head) noexcept {
  std::span<const std::byte> number, unix_time;
  if (!find_field(content, "fnum", number) || number.size() != 4) return false;
  if (!find_field(content, "btrs", head.bones)) return false;
  head.number = ByteReader(number).u32();
  const bool timed = find_field(content, "uttm", unix_time) && unix_time.size() == 8;
  head.unix_s = timed ? ByteReader(unix_time).f64() : std::numeric_limits<double>::quiet_NaN();
  return true;
}

Result<std::vector<BoneEntry>> parse_skeleton(std::span<const std::byte> content) {
  std::span<const std::byte> list;
  if (!find_field(content, "bons", list)) return wrong_skeleton("has no bones");
  FieldReader fields(list);
  std::vector<BoneEntry> bones;
  std::string_view name;
  std::span<const std::byte> value;
  while (fields.next(name, value)) {
    BoneEntry bone;
    if (name != "bndt") continue;
    if (!read_bone(value, true, bone)) return wrong_skeleton("has a damaged bone");
    if (std::ranges::find(bones, bone.id, &BoneEntry::id) != bones.end()) {
      return wrong_skeleton("has bone " + std::to_string(bone.id) + " twice");
    }
    if (bones.size() == static_cast<std::size_t>(kMaxJoints)) {
      return wrong_skeleton("has too many bones");
    }
    bones.push_back(bone);
  }
  if (!fields.ok()) return wrong_skeleton("ends too early");
  if (bones.empty()) return wrong_skeleton("has no bones");
  return bones;
}

std::string bone_name(std::uint16_t id) {
  return id < kBones ? std::string(kRows[id].name) : "bone_" + std::to_string(id);
}

std::optional<Bone> canonical_bone(std::uint16_t id) {
  return id < kBones ? kRows[id].bone : std::nullopt;
}

std::uint16_t usual_parent(std::uint16_t id) { return id < kBones ? kRows[id].parent : kNoParent; }

}  // namespace posed::drivers::mocopi
