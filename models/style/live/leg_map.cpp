#include "models/style/live/leg_map.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

#include "proto/frame/rt_safe.hpp"

namespace posed::style {
namespace {

constexpr float kNoise = 1e-2F;  // over the signal's variance

}  // namespace

RT_SAFE void LegMap::fit(std::span<const std::uint16_t> legs, const PoseCycle& at,
                         const PoseCycle& values) noexcept {
  legs_ = legs;
  at_ = PoseCycle::Zero(kGridFrames, std::ssize(legs));
  for (Eigen::Index i = 0; i < at_.cols(); ++i) at_.col(i) = at.col(legs[i]);
  // The length is the cycle's radius.
  float radius2 = 0.0F;
  for (Eigen::Index i = 0; i < at_.cols(); ++i) {
    radius2 += (at_.col(i).array() - at_.col(i).mean()).square().mean();
  }
  exponent_ = -0.5F / std::max(radius2, 1e-6F);
  Eigen::Matrix<float, kGridFrames, kGridFrames> gram;
  for (Eigen::Index k = 0; k < kGridFrames; ++k) {
    Column squares = Column::Zero();
    for (Eigen::Index i = 0; i < at_.cols(); ++i) {
      squares += (at_.col(i).array() - at_(k, i)).square();
    }
    gram.col(k) = (exponent_ * squares).exp().matrix();
    gram(k, k) += kNoise;
  }
  const Eigen::LLT<Eigen::Matrix<float, kGridFrames, kGridFrames>> factor(gram);
  mean_ = values.colwise().mean();
  weights_ = PoseCycle::Zero(kGridFrames, values.cols());
  for (Eigen::Index d = 0; d < values.cols(); ++d) {
    Eigen::Matrix<float, kGridFrames, 1> column = values.col(d).array() - mean_[d];
    factor.solveInPlace(column);
    weights_.col(d) = column;
  }
}

RT_SAFE void LegMap::get(std::span<const float> q, std::span<const std::uint8_t> available,
                         std::span<float> out) const noexcept {
  Column squares = Column::Zero();
  bool any = false;
  for (Eigen::Index i = 0; i < at_.cols(); ++i) {
    const std::size_t d = legs_[i];
    if (available[d] == 0) continue;
    squares += (at_.col(i).array() - q[d]).square();
    any = true;
  }
  const Column near = any ? Column((exponent_ * squares).exp()) : Column(Column::Zero());
  for (Eigen::Index d = 0; d < weights_.cols(); ++d) {
    out[d] = mean_[d] + near.matrix().dot(weights_.col(d));
  }
}

}  // namespace posed::style
