#include "drivers/landmarks/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/json_reader.hpp"
#include "drivers/pose_values.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers::landmarks {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kMaxNumber = std::numeric_limits<float>::max();

RT_SAFE float narrow(double value) noexcept {
  return std::abs(value) <= kMaxNumber ? static_cast<float>(value)
                                       : std::numeric_limits<float>::quiet_NaN();
}

// `none` where the value is no number.
RT_SAFE double number_of(JsonReader& json, double none) noexcept {
  double value = 0.0;
  return json.number(value) ? value : none;
}

// True if there are exactly 63 numbers; a longer list is left at once.
RT_SAFE bool read_points(JsonReader& json, Landmarks& point_m) noexcept {
  std::size_t count = 0;
  if (!json.enter_array()) return false;
  while (json.next()) {
    double value = 0.0;
    if (!json.number(value)) value = kNone;
    if (count < 3 * kLandmarks) point_m[count / 3][count % 3] = narrow(value);
    ++count;
  }
  return count == 3 * kLandmarks;
}

// In double, so that large floats do not overflow.
RT_SAFE double distance_m(const Vec3f& a, const Vec3f& b) noexcept {
  double squared = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    squared += d * d;
  }
  return std::sqrt(squared);
}

RT_SAFE bool has_size_of_hand(const Landmarks& point_m) noexcept {
  constexpr std::array<std::size_t, 5> kMiddle{0, 9, 10, 11, 12};
  double length_m = 0.0;
  for (std::size_t i = 1; i < kMiddle.size(); ++i) {
    length_m += distance_m(point_m[kMiddle[i - 1]], point_m[kMiddle[i]]);
  }
  return length_m >= kMinHand_m && length_m <= kMaxHand_m;  // false for NaN
}

RT_SAFE void read_side(JsonReader& json, TrackedHand& hand, bool& sided) noexcept {
  std::string_view side;
  sided = json.text(side) && (side == "left" || side == "right");
  hand.side = side == "left" ? Side::kLeft : Side::kRight;
}

RT_SAFE void read_hand(JsonReader& json, TrackedHand& hand) noexcept {
  bool whole = false, sided = false, told = true;
  hand.score = 1.0;
  hand.sure = false;
  if (json.enter_object()) {
    for (std::string_view key; json.next(key);) {
      if (key == "side") {
        read_side(json, hand, sided);
      } else if (key == "sure") {
        told = json.boolean(hand.sure);
      } else if (key == "score") {
        hand.score = number_of(json, kNone);
      } else if (key == "points") {
        whole = read_points(json, hand.point_m);
      } else {
        json.skip();
      }
    }
  }
  const bool near = std::ranges::all_of(hand.point_m, is_plausible);
  const bool sound =
      sided && told && hand.score >= 0.0 && hand.score <= 1.0 && near;  // false for NaN
  hand.outcome = Outcome::kOk;
  if (!whole) {
    hand.outcome = Outcome::kShort;
  } else if (!sound || (hand.seen() && !has_size_of_hand(hand.point_m))) {
    hand.outcome = Outcome::kOutOfRange;
  }
}

// False when there are more than two, or two that are surely of one side. `listed`: it is a list.
RT_SAFE bool read_hands(JsonReader& json, Message& message, bool& listed) noexcept {
  listed = json.enter_array();
  if (!listed) return true;
  while (json.next()) {
    if (message.count == kMaxHands) return false;
    read_hand(json, message.hands[message.count++]);
  }
  const auto& [first, second] = message.hands;
  return message.count < kMaxHands || first.outcome != Outcome::kOk ||
         second.outcome != Outcome::kOk || !first.sure || !second.sure || first.side != second.side;
}

// What the members besides the hands say.
struct Head {
  bool landmarks = false;
  double version = 0.0;
  bool in_range = true;
  bool whole = true;  // each member that is named above is of its kind
  bool hands = false;
};

RT_SAFE void read_member(JsonReader& json, std::string_view key, Head& head,
                         Message& message) noexcept {
  if (key == "posed") {
    std::string_view kind;
    head.landmarks = json.text(kind) && kind == "landmarks";
  } else if (key == "version") {
    head.version = number_of(json, 0.0);
  } else if (key == "time_ns") {
    double time_ns = 0.0;
    const bool number = json.number(time_ns);
    head.whole = number && head.whole;
    head.in_range = (!number || std::isfinite(time_ns)) && head.in_range;
    message.time_s = time_ns * 1e-9;
  } else if (key == "end") {
    head.whole = json.boolean(message.end) && head.whole;
  } else if (key == "hands") {
    head.in_range = read_hands(json, message, head.hands) && head.in_range;
    head.whole = head.hands && head.whole;
  } else {
    json.skip();
  }
}

}  // namespace

RT_SAFE Outcome read_message(std::string_view json, Message& message) noexcept {
  if (json.size() > kMaxMessage) return Outcome::kOutOfRange;
  JsonReader reader(json);
  message.time_s = kNone;
  message.count = 0;
  message.end = false;
  Head head;
  if (!reader.enter_object()) return Outcome::kForeign;
  for (std::string_view key; head.in_range && reader.next(key);) {
    read_member(reader, key, head, message);
  }
  if (!head.in_range || reader.fault() == JsonReader::Fault::kDeep) return Outcome::kOutOfRange;
  if (!reader.ok()) return Outcome::kShort;
  if (!head.landmarks || head.version != 1.0) return Outcome::kForeign;
  const bool whole = head.whole && (head.hands || message.end);
  return whole && reader.at_end() ? Outcome::kOk : Outcome::kShort;
}

std::string write_message(const Message& message) {
  std::string text = R"({"posed":"landmarks","version":1,"time_ns":)" +
                     std::to_string(std::llround(message.time_s * 1e9)) +
                     (message.end ? R"(,"end":true)" : "") + R"(,"hands":[)";
  for (std::size_t i = 0; i < message.count; ++i) {
    const TrackedHand& hand = message.hands[i];
    text += std::string(i == 0 ? "" : ",") + R"({"side":")" +
            (hand.side == Side::kLeft ? "left" : "right") + '"' +
            (hand.sure ? R"(,"sure":true)" : "") + R"(,"score":)" + clip::number_text(hand.score) +
            R"(,"points":[)";
    for (std::size_t k = 0; k < 3 * kLandmarks; ++k) {
      const double x_m = static_cast<double>(hand.point_m[k / 3][k % 3]);
      text += (k == 0 ? "" : ",") + clip::number_text(std::round(x_m * 1e7) * 1e-7);
    }
    text += "]}";
  }
  return text + "]}\n";
}

}  // namespace posed::drivers::landmarks
