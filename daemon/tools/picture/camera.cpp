#include "daemon/tools/picture/camera.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::picture {
namespace {

constexpr double kQuarter_rad = 40.0 * kDegree;  // of a three-quarter view, from the front
constexpr double kAbove_rad = 8.0 * kDegree;

}  // namespace

Result<View> view_from_name(std::string_view name) {
  if (name == "front") return View::kFront;
  if (name == "side") return View::kSide;
  if (name == "three-quarter") return View::kThreeQuarter;
  return misuse("the view " + in_quotes(name) + " is none of front, side and three-quarter");
}

std::string_view view_words(View view) {
  if (view == View::kFront) return "from the front";
  return view == View::kSide ? "from the side" : "in three-quarter view";
}

Camera::Camera(View view, const Facing& facing) : up_(facing.up), near_(facing.forward) {
  if (view == View::kSide) near_ = facing.side;
  if (view == View::kThreeQuarter) {
    near_ = std::cos(kQuarter_rad) * facing.forward + std::sin(kQuarter_rad) * facing.side;
    up_ = std::cos(kAbove_rad) * facing.up - std::sin(kAbove_rad) * near_;
    near_ = std::cos(kAbove_rad) * near_ + std::sin(kAbove_rad) * facing.up;
  }
  right_ = up_.cross(near_);
}

}  // namespace posed::picture
