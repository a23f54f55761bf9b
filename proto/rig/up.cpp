#include "proto/rig/up.hpp"

namespace posed {
namespace {

constexpr std::array<std::string_view, kUpAxes.size()> kUpTexts{"+y", "+z", "-y", "-z", "+x"};
// In the order of rig::kAxes.
constexpr std::array<std::string_view, 6> kAxisTexts{"+x", "-x", "+y", "-y", "+z", "-z"};

}  // namespace

std::string_view up_text(UpAxis up) { return kUpTexts[static_cast<std::size_t>(up)]; }

std::optional<UpAxis> up_from_text(std::string_view text) {
  const auto at = std::ranges::find(kUpTexts, text);
  if (at == kUpTexts.end()) return std::nullopt;
  return static_cast<UpAxis>(at - kUpTexts.begin());
}

std::optional<Eigen::Vector3d> axis_from_text(std::string_view text) {
  const auto at = std::ranges::find(kAxisTexts, text);
  if (at == kAxisTexts.end()) return std::nullopt;
  return rig::kAxes[static_cast<std::size_t>(at - kAxisTexts.begin())];
}

std::string_view axis_text(const Eigen::Vector3d& direction) {
  const auto along = [&](const Eigen::Vector3d& axis) { return direction.dot(axis); };
  const auto at = std::ranges::max_element(rig::kAxes, {}, along);
  return kAxisTexts[static_cast<std::size_t>(at - rig::kAxes.begin())];
}

Eigen::Matrix3d up_turn(UpAxis up) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
  switch (up) {
    case UpAxis::kPlusY:
      break;
    case UpAxis::kPlusZ:
      m << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      break;
    case UpAxis::kMinusY:
      m.diagonal() << 1, -1, -1;
      break;
    case UpAxis::kMinusZ:
      m << 1, 0, 0, 0, 0, -1, 0, 1, 0;
      break;
    case UpAxis::kPlusX:
      m << 0, -1, 0, 1, 0, 0, 0, 0, 1;
      break;
  }
  return m;
}

}  // namespace posed
