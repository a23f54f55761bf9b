#include "proto/frame/hand_shape.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed {
namespace {

constexpr double kMillimetre = 1e-3;
constexpr Range kPoint_mm{-1000.0, 1000.0};
constexpr Range kLength_mm{0.1, 1000.0};
constexpr Range kAngle_deg{-360.0, 360.0};
constexpr Range kLimit_deg{-180.0, 180.0};

void read_limits(TableReader& table, std::string_view key, std::size_t axis, FingerShape& finger) {
  const auto joints = table.pairs(key, kLimit_deg);
  if (!joints) return;
  if (joints->size() != kFingerJoints) {
    return table.add_error(key, "limits are three pairs, [least, most] of joints 1 to 3");
  }
  for (std::size_t j = 0; j < kFingerJoints; ++j) {
    const auto [low, high] = (*joints)[j];
    if (low > 0.0 || high < 0.0) {
      return table.add_error(key, "a limit is [least, most] in degrees, with 0 between them");
    }
    finger.range[j][axis] = {low * kDegree, high * kDegree};
  }
}

void read_finger(TableReader& table, FingerShape& finger) {
  for (const char* key : {"base_mm", "length_mm", "radius_mm", "x_deg", "y_deg", "z_deg"}) {
    table.need(key, "every finger has it");
  }
  const auto in_metres = [&](std::string_view key, Range range) {
    auto values = table.numbers<3>(key, range).value_or(std::array<double, 3>{});
    for (double& value : values) value *= kMillimetre;
    return values;
  };
  finger.base_m = Eigen::Vector3d(in_metres("base_mm", kPoint_mm).data());
  finger.length_m = in_metres("length_mm", kLength_mm);
  finger.radius_m = in_metres("radius_mm", kLength_mm);
  const auto read_frame = [&](std::string_view key, Eigen::Quaterniond& frame) {
    const auto angle_deg = table.numbers<3>(key, kAngle_deg);
    if (!angle_deg) return;
    const auto [x, y, z] = *angle_deg;
    frame = axis_rotation(Axis::kY, y * kDegree) * axis_rotation(Axis::kX, x * kDegree) *
            axis_rotation(Axis::kZ, z * kDegree);
  };
  read_frame("frame_deg", finger.frame);
  finger.root = finger.frame;
  read_frame("root_deg", finger.root);
  read_limits(table, "x_deg", 0, finger);
  read_limits(table, "y_deg", 1, finger);
  read_limits(table, "z_deg", 2, finger);
  table.finish();
}

}  // namespace

Result<HandShape> parse_hand_shape(std::string_view text, const std::string& file) {
  const auto table = TRY(parse_toml(text, file, {.what = "hand"}));
  Findings findings{.file = file};
  TableReader reader(table, "", findings);
  HandShape shape;
  reader.require("name", shape.name);
  for (std::size_t f = 0; f < kFingers; ++f) {
    reader.need(kFingerNames[f], "a hand has five fingers");
    if (auto finger = reader.table(kFingerNames[f])) read_finger(*finger, shape.fingers[f]);
  }
  reader.finish();
  return findings.result(std::move(shape));
}

std::span<const HandShape> hand_shapes() {
  static const std::vector<HandShape> all = [] {
    std::vector<HandShape> read;
    for (const ConfigText& text : hand_texts()) {
      auto shape = parse_hand_shape(text.content, std::string(text.file));
      if (!shape) {  // a bug in posed: the text is built into the program
        std::fprintf(stderr, "posed: %s\n", shape.error().text().c_str());
        std::abort();
      }
      read.push_back(std::move(*shape));
    }
    return read;
  }();
  return all;
}

Result<const HandShape*> find_hand_shape(const std::string& name) {
  std::string known;
  for (const HandShape& shape : hand_shapes()) {
    if (shape.name == name) return &shape;
    add_word(known, shape.name);
  }
  return misuse("there is no hand " + in_quotes(name) + "; there are " + known);
}

const HandShape& default_hand_shape() {
  static const HandShape& shape = **find_hand_shape(std::string(kDefaultHandShape));
  return shape;
}

}  // namespace posed
