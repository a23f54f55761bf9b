#include "drivers/natnet/figure.hpp"

#include <string_view>
#include <utility>

#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/layout.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::string_view kPerson = "Emma";
constexpr std::string_view kWand = "Wand";

// Adds bones to a skeleton, each by the name of its parent.
class Figure {
 public:
  explicit Figure(BodyDef& body) : body_(body) {}

  void add(const std::string& name, const std::string& parent, const Vec3f& offset_m) {
    BoneDef bone{.name = body_.name + '_' + name,
                 .id = static_cast<std::int32_t>(body_.bones.size() + 1),
                 .parent = 0,
                 .offset_m = offset_m};
    for (const BoneDef& other : body_.bones) {
      if (other.name == body_.name + '_' + parent) bone.parent = other.id;
    }
    body_.bones.push_back(std::move(bone));
  }

 private:
  BodyDef& body_;
};

// `side` is 1 for the left, which lies at +X, and -1 for the right.
void add_hand(Figure& figure, const std::string& letter, float side) {
  struct Finger {
    std::string name;
    float z_m;
    Vec3f lengths_m;  // from the hand to its first joint, and on
  };
  const std::array<Finger, 5> fingers{{{"Thumb", 0.03F, {0.02F, 0.04F, 0.03F}},
                                       {"Index", 0.03F, {0.09F, 0.04F, 0.025F}},
                                       {"Middle", 0.01F, {0.09F, 0.045F, 0.03F}},
                                       {"Ring", -0.01F, {0.085F, 0.04F, 0.03F}},
                                       {"Pinky", -0.03F, {0.08F, 0.03F, 0.02F}}}};
  for (const Finger& finger : fingers) {
    std::string parent = letter + "Hand";
    for (std::size_t i = 0; i < finger.lengths_m.size(); ++i) {
      const std::string name = letter + finger.name + std::to_string(i + 1);
      figure.add(name, parent, {side * finger.lengths_m[i], 0.0F, i == 0 ? finger.z_m : 0.0F});
      parent = name;
    }
  }
}

void add_arm(Figure& figure, const std::string& letter, float side, bool fingers) {
  figure.add(letter + "Shoulder", "Chest", {side * 0.04F, 0.2F, 0.0F});
  figure.add(letter + "UArm", letter + "Shoulder", {side * 0.12F, 0.0F, 0.0F});
  figure.add(letter + "FArm", letter + "UArm", {side * 0.28F, 0.0F, 0.0F});
  figure.add(letter + "Hand", letter + "FArm", {side * 0.25F, 0.0F, 0.0F});
  if (fingers) add_hand(figure, letter, side);
}

void add_leg(Figure& figure, const std::string& letter, float side) {
  figure.add(letter + "Thigh", "Hip", {side * 0.09F, 0.0F, 0.0F});
  figure.add(letter + "Shin", letter + "Thigh", {0.0F, -0.43F, 0.0F});
  figure.add(letter + "Foot", letter + "Shin", {0.0F, -0.42F, 0.0F});
  figure.add(letter + "Toe", letter + "Foot", {0.0F, -0.06F, 0.14F});
}

}  // namespace

BodyDef average_person(const std::string& name, std::int32_t id, float scale, bool fingers) {
  BodyDef body{.name = name, .id = id, .is_skeleton = true, .bones = {}};
  Figure figure(body);
  figure.add("Hip", "", {0.0F, 0.95F, 0.0F});
  figure.add("Ab", "Hip", {0.0F, 0.08F, 0.0F});
  figure.add("Chest", "Ab", {0.0F, 0.2F, 0.0F});
  figure.add("Neck", "Chest", {0.0F, 0.25F, 0.0F});
  figure.add("Head", "Neck", {0.0F, 0.14F, 0.02F});
  add_arm(figure, "L", 1.0F, fingers);
  add_arm(figure, "R", -1.0F, fingers);
  add_leg(figure, "L", 1.0F);
  add_leg(figure, "R", -1.0F);
  for (BoneDef& bone : body.bones) {
    for (float& x_m : bone.offset_m) x_m *= scale;
  }
  return body;
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyDef& body) {
  constexpr Version kAny{3, 0};
  ModelDef model;
  model.bodies.push_back(body);
  const auto layout = TRY(make_layout(encode_description(model, kAny, {.version = kAny})));
  return layout->bodies[0].skeleton;
}

ModelDef emulated_model() {
  const std::string wand(kWand);
  ModelDef model;
  model.bodies.push_back(average_person(std::string(kPerson), kPersonId, 1.0F, /*fingers=*/true));
  model.bodies.push_back(
      {.name = wand,
       .id = kWandId,
       .is_skeleton = false,
       .bones = {{.name = wand, .id = kWandId, .parent = -1, .markers = kWandMarkers_m.size()}}});
  model.markers = {{"all", kWandMarkers_m.size()}, {wand, kWandMarkers_m.size()}};
  return model;
}

}  // namespace posed::drivers::natnet
