// Any text as a URDF: a sentence, or a hand whose start pose and skeleton are sound.
#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "models/robot/robot_hand.hpp"
#include "tests/fuzz/demand.hpp"

using posed::fuzz::demand;

namespace {

void check_sentence(const posed::Error& error) {
  const std::string text = error.text();
  demand(!error.message.empty() && text.size() < 10'000);
  demand(std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7F; }));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  auto urdf = posed::robot::parse_urdf(text, "fuzz.urdf");
  if (!urdf) return check_sentence(urdf.error()), 0;
  const auto hand = posed::robot::robot_hand(std::move(*urdf), {}, "fuzz.urdf");
  if (!hand) return check_sentence(hand.error()), 0;
  for (const posed::robot::RobotJoint& joint : hand->joints) {
    const double angle = posed::robot::angle_of(joint, hand->start());
    demand(angle >= joint.low && angle <= joint.high);
  }
  const auto skeleton = posed::robot::robot_skeleton(*hand);
  if (!skeleton) return check_sentence(skeleton.error()), 0;
  demand(skeleton->channels.size() == hand->joints.size());
  return 0;
}
