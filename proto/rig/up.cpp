#include "proto/rig/up.hpp"

namespace posed {
namespace {

constexpr std::array<std::string_view, kUpAxes.size()> kUpTexts{"+y", "+z", "-y", "-z", "+x"};

}  // namespace

std::string_view up_text(UpAxis up) { return kUpTexts[static_cast<std::size_t>(up)]; }

std::optional<UpAxis> up_from_text(std::string_view text) {
  const auto at = std::ranges::find(kUpTexts, text);
  if (at == kUpTexts.end()) return std::nullopt;
  return static_cast<UpAxis>(at - kUpTexts.begin());
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
