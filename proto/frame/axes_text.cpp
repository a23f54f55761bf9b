#include "proto/frame/axes_text.hpp"

#include <cmath>

namespace posed {

std::optional<Eigen::Quaterniond> axes_from_text(std::string_view text) {
  if (text.size() != 6) return std::nullopt;
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const char sign = text[2 * static_cast<std::size_t>(i)];
    const char axis = text[2 * static_cast<std::size_t>(i) + 1];
    if ((sign != '+' && sign != '-') || axis < 'x' || axis > 'z') return std::nullopt;
    m(axis - 'x', i) = sign == '-' ? -1.0 : 1.0;
  }
  if (std::abs(m.determinant() - 1.0) > 0.5) return std::nullopt;
  return Eigen::Quaterniond(m);
}

}  // namespace posed
