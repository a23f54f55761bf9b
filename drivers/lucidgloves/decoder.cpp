#include "drivers/lucidgloves/decoder.hpp"

#include <limits>

#include "drivers/glove/angle_map.hpp"

namespace posed::drivers::lucidgloves {
namespace {

constexpr std::size_t kSticks = 3;                       // joystick X and Y, analog trigger
constexpr std::size_t kExtras = kSticks + kButtons + 2;  // and firmware, hand
constexpr int kNewHabit =
    8;  // lines in a row without a key before the glove is taken not to send it

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();  // not valid in the Sample

}  // namespace

Result<glove::Model> model(const Settings& settings) {
  glove::Model model{.driver = "lucidgloves", .sensors = {}};
  const double max = settings.max_analog;
  for (const std::string_view finger : kFingerNames) {
    for (int j = 0; j < kJoints; ++j) {
      model.sensors.push_back({.name = std::string(finger) + "_joint" + std::to_string(j),
                               .raw_max = max,
                               .curve = glove::Curve::line(0.0, 0.0, max, 1.0),
                               .unit = "1"});
    }
  }
  for (const std::string_view finger : kFingerNames) {
    model.sensors.push_back({.name = std::string(finger) + "_splay",
                             .raw_max = max,
                             .curve = glove::Curve::line(0.0, -1.0, max, 1.0),
                             .unit = "1"});
  }
  return glove::with_device_table(std::move(model), "lucidgloves");
}

std::vector<std::string> extra_names() {
  std::vector<std::string> names{"joystick_x", "joystick_y", "trigger"};
  names.insert(names.end(), kButtonNames.begin(), kButtonNames.end());
  names.insert(names.end(), {"firmware", "is_right"});
  return names;
}

RT_SAFE void LucidDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                Sink& sink) noexcept {
  lines_.feed(
      bytes, [&](std::string_view text) { accept_line(text, sink); },
      [&] { sink.outcome(Outcome::kForeign); });
}

RT_SAFE void LucidDecoder::accept_line(std::string_view text, Sink& sink) noexcept {
  Line line;
  Outcome outcome = parse_line(text, settings_.encoding, settings_.max_analog, line);
  if (outcome == Outcome::kOk && line.has_hand() && lost_a_key(line)) outcome = Outcome::kShort;
  sink.outcome(outcome);
  if (outcome != Outcome::kOk) return;
  for (std::size_t i = 0; i < info_.size(); ++i) {
    if (!line.has_info[i]) continue;
    info_[i] = line.info[i];
    has_info_[i] = true;
  }
  if (line.has_hand()) emit_line(line, sink);
}

// A glove sends the same fingers in every line: one that lacks some of them is damaged, until it
// has done so for a while.
RT_SAFE bool LucidDecoder::lost_a_key(const Line& line) noexcept {
  std::bitset<kSplay> sent;
  for (std::size_t i = 0; i < kSplay; ++i) sent[i] = line.has[i];
  const bool lost = (usual_ & ~sent).any();
  unusual_lines_ = lost ? unusual_lines_ + 1 : 0;
  if (lost && unusual_lines_ < kNewHabit) return true;
  unusual_lines_ = 0;
  usual_ = sent;
  return false;
}

RT_SAFE void LucidDecoder::compute(std::span<float> value,
                                   std::bitset<glove::kMaxSensors>& valid) const noexcept {
  for (std::size_t f = 0; f < kFingers; ++f) {
    const std::size_t splay = kFingers * kJoints + f;
    if (valid[splay] || !valid[f * kJoints + 1]) continue;
    value[splay] = 0.0F;
    valid[splay] = true;
  }
}

RT_SAFE void LucidDecoder::emit_line(const Line& line, Sink& sink) noexcept {
  std::array<float, kSensors> raw{};
  glove::Packet packet{.raw = raw, .valid = {}, .extra = {}};
  for (std::size_t i = 0; i < kFingers * kJoints; ++i) {
    const std::size_t curl = kCurl + i / kJoints;
    const std::size_t place = line.has[kJoint + i] ? kJoint + i : curl;
    raw[i] = static_cast<float>(line.value[place]);
    packet.valid[i] = line.has[place];
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    raw[kFingers * kJoints + f] = static_cast<float>(line.value[kSplay + f]);
    packet.valid[kFingers * kJoints + f] = line.has[kSplay + f];
  }
  const auto max = static_cast<float>(settings_.max_analog);
  const auto share = [&](std::size_t place) {
    return line.has[place] ? static_cast<float>(line.value[place]) / max : kUnknown;
  };
  const auto info = [&](std::size_t place) {
    return has_info_[place] ? static_cast<float>(info_[place]) : kUnknown;
  };
  std::array<float, kExtras> extra{};
  extra[0] = 2.0F * share(kJoyX) - 1.0F;
  extra[1] = 2.0F * share(kJoyY) - 1.0F;
  extra[2] = share(kTrigger);
  for (std::size_t b = 0; b < kButtons; ++b) extra[kSticks + b] = line.pressed[b] ? 1.0F : 0.0F;
  extra[kSticks + kButtons] = info(0);
  extra[kSticks + kButtons + 1] = info(2);
  packet.extra = extra;
  emit(packet, sink);
}

}  // namespace posed::drivers::lucidgloves
