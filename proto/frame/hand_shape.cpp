#include "proto/frame/hand_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include "proto/frame/degree.hpp"
#include "proto/frame/profile_texts.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/toml.hpp"

namespace posed {
namespace {

constexpr double kMillimetre = 1e-3;
constexpr double kLongest_m = 1.0;  // largest length anywhere in a hand

class HandReader : private FirstError {
 public:
  using FirstError::FirstError;

  Result<HandShape> read(const toml::table& table) {
    for (const auto& [key, node] : table) entry(key.str(), node);
    if (shape_.name.empty()) add_error(table, "a hand needs a name");
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (!seen_[f]) add_error(table, "the hand lacks its [" + std::string(kFingerNames[f]) + "]");
    }
    if (error()) return std::unexpected(*error());
    return std::move(shape_);
  }

 private:
  void entry(std::string_view key, const toml::node& node) {
    const auto finger = std::ranges::find(kFingerNames, key);
    if (key == "name") {
      shape_.name = node.value_or("");
    } else if (finger != kFingerNames.end() && node.is_table()) {
      const auto f = static_cast<std::size_t>(finger - kFingerNames.begin());
      seen_[f] = true;
      read_finger(*node.as_table(), shape_.fingers[f]);
    } else {
      add_error(node, in_quotes(key) + " is not known in a hand, or of another type");
    }
  }

  void read_finger(const toml::table& table, FingerShape& finger) {
    for (const std::string_view needed :
         {"base_mm", "length_mm", "radius_mm", "x_deg", "y_deg", "z_deg"}) {
      if (!table.contains(needed)) add_error(table, "a finger needs " + std::string(needed));
    }
    for (const auto& [toml_key, node] : table) {
      const std::string_view key = toml_key.str();
      if (key == "base_mm") {
        finger.base_m = point(node);
      } else if (key == "frame_deg") {
        const Eigen::Vector3d angle = numbers(node, 360.0) * kDegree;
        finger.frame = axis_rotation(Axis::kY, angle.y()) * axis_rotation(Axis::kX, angle.x()) *
                       axis_rotation(Axis::kZ, angle.z());
      } else if (key == "length_mm") {
        for (int j = 0; j < kFingerJoints; ++j) finger.length_m[j] = lengths(node)[j];
      } else if (key == "radius_mm") {
        for (int j = 0; j < kFingerJoints; ++j) finger.radius_m[j] = lengths(node)[j];
      } else if (key.size() == 5 && key.ends_with("_deg") && key[0] >= 'x' && key[0] <= 'z') {
        read_ranges(node, static_cast<std::size_t>(key[0] - 'x'), finger);
      } else {
        add_error(node, in_quotes(key) + " is not known in a finger");
      }
    }
  }

  void read_ranges(const toml::node& node, std::size_t axis, FingerShape& finger) {
    const toml::array* const joints = node.as_array();
    if (joints == nullptr || joints->size() != kFingerJoints) {
      return add_error(node, "limits are three pairs, [least, most] of joints 1 to 3");
    }
    for (std::size_t j = 0; j < kFingerJoints; ++j) {
      const toml::array* const pair = joints->get(j)->as_array();
      const bool is_pair = pair != nullptr && pair->size() == 2;
      const auto low = is_pair ? pair->get(0)->value<double>() : std::nullopt;
      const auto high = is_pair ? pair->get(1)->value<double>() : std::nullopt;
      if (!low || !high || !(*low <= 0.0) || !(*high >= 0.0) || *low < -180 || *high > 180) {
        return add_error(node, "a limit is [least, most] in degrees, with 0 between them");
      }
      finger.range[j][axis] = {*low * kDegree, *high * kDegree};
    }
  }

  // Reads three numbers of at most `most` in size; returns zeros after a mistake.
  Eigen::Vector3d numbers(const toml::node& node, double most) {
    const toml::array* const array = node.as_array();
    Eigen::Vector3d read = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto value =
          array != nullptr && array->size() == 3 ? array->get(i)->value<double>() : std::nullopt;
      if (!value || !(std::abs(*value) <= most)) {
        add_error(node, "three numbers are wanted here, of a size that fits a hand");
        return Eigen::Vector3d::Zero();
      }
      read[static_cast<int>(i)] = *value;
    }
    return read;
  }

  Eigen::Vector3d point(const toml::node& node) {
    return numbers(node, kLongest_m / kMillimetre) * kMillimetre;
  }

  Eigen::Vector3d lengths(const toml::node& node) {
    const Eigen::Vector3d read = point(node);
    if (!(read.minCoeff() > 0)) add_error(node, "lengths are above zero");
    return read;
  }

  HandShape shape_;
  std::array<bool, kFingers> seen_{};
};

}  // namespace

Result<HandShape> parse_hand_shape(std::string_view text, const std::string& file) {
  const auto table = parse_toml(text, file, {.what = "hand"});
  if (!table) return std::unexpected(table.error());
  return HandReader(file).read(*table);
}

std::span<const HandShape> hand_shapes() {
  static const std::vector<HandShape> all = [] {
    std::vector<HandShape> read;
    for (const ProfileText& text : hand_texts()) {
      auto shape = parse_hand_shape(text.toml, std::string(text.file));
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
    known += (known.empty() ? "" : ", ") + shape.name;
  }
  return misuse("there is no hand " + in_quotes(name) + "; there are " + known);
}

const HandShape& default_hand_shape() {
  static const HandShape& shape = **find_hand_shape(std::string(kDefaultHandShape));
  return shape;
}

}  // namespace posed
