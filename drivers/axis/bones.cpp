#include "drivers/axis/bones.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace posed::drivers::axis {
namespace {

struct Row {
  std::string_view side;
  std::string_view name;
  int parent = -1;
  Vec3f offset_cm{};
  Vec3f end_cm{};
};

constexpr int kTopOfTrunk =
    10;  // Spine3, which carries neck and shoulders; in Axis Studio 9, Spine2
constexpr Vec3f kFootEnd_cm{0, -8, 18};

constexpr std::array<Row, 13> kBody{{{"", "Hips", -1, {0, 96, 0}},
                                     {"", "RightUpLeg", 0, {-9, -2, 0}},
                                     {"", "RightLeg", 1, {0, -43, 0}},
                                     {"", "RightFoot", 2, {0, -43, 0}, kFootEnd_cm},
                                     {"", "LeftUpLeg", 0, {9, -2, 0}},
                                     {"", "LeftLeg", 4, {0, -43, 0}},
                                     {"", "LeftFoot", 5, {0, -43, 0}, kFootEnd_cm},
                                     {"", "Spine", 0, {0, 10, 0}},
                                     {"", "Spine1", 7, {0, 10, 0}},
                                     {"", "Spine2", 8, {0, 10, 0}},
                                     {"", "Spine3", 9, {0, 10, 0}},
                                     {"", "Neck", kTopOfTrunk, {0, 11, 0}},
                                     {"", "Head", 11, {0, 9, 0}, {0, 17, 0}}}};

// Of the left side; parents count from the shoulder, whose own is the top of the trunk.
constexpr std::array<Row, 23> kArm{{{"", "Shoulder", -1, {3.5F, 7, 0}},
                                    {"", "Arm", 0, {14, 0, 0}},
                                    {"", "ForeArm", 1, {28, 0, 0}},
                                    {"", "Hand", 2, {26, 0, 0}},
                                    {"", "HandThumb1", 3, {2.5F, 0, 3.5F}},
                                    {"", "HandThumb2", 4, {4, 0, 0}},
                                    {"", "HandThumb3", 5, {3, 0, 0}, {2.5F, 0, 0}},
                                    {"", "InHandIndex", 3, {3.5F, 0.5F, 2.2F}},
                                    {"", "HandIndex1", 7, {5.6F, 0, 1}},
                                    {"", "HandIndex2", 8, {4, 0, 0}},
                                    {"", "HandIndex3", 9, {2.3F, 0, 0}, {2, 0, 0}},
                                    {"", "InHandMiddle", 3, {3.5F, 0.5F, 0.8F}},
                                    {"", "HandMiddle1", 11, {5.8F, 0, 0.3F}},
                                    {"", "HandMiddle2", 12, {4.4F, 0, 0}},
                                    {"", "HandMiddle3", 13, {2.7F, 0, 0}, {2.2F, 0, 0}},
                                    {"", "InHandRing", 3, {3.5F, 0.5F, -0.4F}},
                                    {"", "HandRing1", 15, {5.3F, 0, -0.4F}},
                                    {"", "HandRing2", 16, {3.9F, 0, 0}},
                                    {"", "HandRing3", 17, {2.6F, 0, 0}, {2.1F, 0, 0}},
                                    {"", "InHandPinky", 3, {3.4F, 0.4F, -1.5F}},
                                    {"", "HandPinky1", 19, {4.7F, 0, -1.1F}},
                                    {"", "HandPinky2", 20, {3.1F, 0, 0}},
                                    {"", "HandPinky3", 21, {1.9F, 0, 0}, {1.8F, 0, 0}}}};
static_assert(kBody.size() + 2 * kArm.size() == kBones);

constexpr std::array<Row, kBones> kRows = [] {
  std::array<Row, kBones> rows{};
  std::size_t at = 0;
  for (const Row& row : kBody) rows[at++] = row;
  for (const std::string_view side : {"Right", "Left"}) {
    const auto shoulder = static_cast<int>(at);
    const float sign = side == "Left" ? 1.0F : -1.0F;
    for (Row row : kArm) {
      row.side = side;
      row.parent = row.parent < 0 ? kTopOfTrunk : shoulder + row.parent;
      row.offset_cm[0] *= sign;
      row.end_cm[0] *= sign;
      rows[at++] = row;
    }
  }
  return rows;
}();

constexpr Proportions kProportions = [] {
  Proportions all{};
  for (std::size_t b = 0; b < kBones; ++b) all[b] = kRows[b].offset_cm;
  return all;
}();

// The same person: shoulders, base of the neck and head are where they are in the other figure.
constexpr Proportions kStudioProportions = [] {
  Proportions all = kProportions;
  const float trunk_cm = all[kTopOfTrunk][1], neck_cm = all[kTopOfTrunk + 2][1];
  for (std::size_t b = kTopOfTrunk + 1; b < kBones; ++b) {
    if (kRows[b].parent == kTopOfTrunk) all[b][1] += trunk_cm;
  }
  all[kTopOfTrunk] = all[kTopOfTrunk + 1];
  all[kTopOfTrunk + 1] = all[kTopOfTrunk + 2] = {0, neck_cm / 2, 0};
  return all;
}();

// The axis along which a bone points in T-pose; 3 for other bones.
RT_SAFE std::size_t axis_of(const Vec3f& offset) noexcept {
  std::size_t found = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    if (offset[i] == 0.0F) continue;
    if (found != 3) return 3;
    found = i;
  }
  return found;
}

}  // namespace

std::string bone_name(std::size_t bone, Figure figure) {
  if (figure == Figure::kStudio && bone == kTopOfTrunk) return "Neck";
  if (figure == Figure::kStudio && bone == kTopOfTrunk + 1) return "Neck1";
  return std::string(kRows[bone].side) + std::string(kRows[bone].name);
}

int bone_parent(std::size_t bone, Figure figure) noexcept {
  const int parent = kRows[bone].parent;
  const bool on_trunk = figure == Figure::kStudio && parent == kTopOfTrunk;
  return on_trunk && bone != kTopOfTrunk + 1 ? parent - 1 : parent;
}

Vec3f bone_end_cm(std::size_t bone) noexcept { return kRows[bone].end_cm; }

const Proportions& default_proportions(Figure figure) noexcept {
  return figure == Figure::kStudio ? kStudioProportions : kProportions;
}

// On the vendor's own files ("PN Pro.bvh", "PNS.bvh") 10 and 19 cm.
Figure figure_with(const Proportions& offset_cm) noexcept {
  constexpr float kNeck_cm = 13.0F;
  const Vec3f& offset = offset_cm[kTopOfTrunk];
  const float length_cm = std::hypot(offset[0], offset[1], offset[2]);
  return length_cm > kNeck_cm ? Figure::kStudio : Figure::kPro;
}

RT_SAFE Vec3f offset_from(std::size_t bone, const Vec3f& displacement_cm) noexcept {
  constexpr float kNear = 0.966F;  // cosine of 15 degrees; the shifts turn a bone by less than 5
  const std::size_t axis = axis_of(kProportions[bone]);
  if (axis == 3) return displacement_cm;
  const float length = std::hypot(displacement_cm[0], displacement_cm[1], displacement_cm[2]);
  const float along = std::copysign(1.0F, kProportions[bone][axis]);
  if (displacement_cm[axis] * along < kNear * length) return displacement_cm;
  Vec3f offset{};
  offset[axis] = along * length;
  return offset;
}

}  // namespace posed::drivers::axis
