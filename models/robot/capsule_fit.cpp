#include "models/robot/capsule_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace posed::robot {
namespace {

// A capsule along z of `axes` that holds all corners: around the smallest circle that holds them
// across (Badoiu and Clarkson's steps), as long as those at the ends need; the wider, the shorter.
CapsuleFit fit_along(const std::vector<Eigen::Vector3d>& corners, const Eigen::Matrix3d& axes,
                     double wider) {
  constexpr int kSteps = 100;
  std::vector<Eigen::Vector3d> local;
  for (const auto& corner : corners) local.emplace_back(axes.transpose() * corner);
  Eigen::Vector2d circle = local.front().head<2>();
  const auto away = [&](const Eigen::Vector3d& corner) {
    return (corner.head<2>() - circle).norm();
  };
  for (int i = 1; i <= kSteps; ++i) {
    const auto& farthest = *std::ranges::max_element(local, {}, away);
    circle += (farthest.head<2>() - circle) / (i + 1.0);
  }
  CapsuleFit fit;
  fit.radius_m = wider * away(*std::ranges::max_element(local, {}, away));
  double low = 1e9, high = -1e9;
  for (const auto& corner : local) {
    const double cap =
        std::sqrt(std::max(0.0, fit.radius_m * fit.radius_m - away(corner) * away(corner)));
    low = std::min(low, corner.z() + cap);
    high = std::max(high, corner.z() - cap);
  }
  // Where the caps hold all, it is a ball.
  if (low > high) low = high = 0.5 * (low + high);
  fit.length_m = high - low;
  fit.at.linear() = axes;
  fit.at.translation() = axes * Eigen::Vector3d(circle.x(), circle.y(), 0.5 * (low + high));
  return fit;
}

}  // namespace

CapsuleFit fit_capsule(const std::vector<Eigen::Vector3d>& corners, const CapsuleCost& cost) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& corner : corners) mean += corner / static_cast<double>(corners.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& corner : corners) spread += (corner - mean) * (corner - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Eigen::Matrix3d main = solver.eigenvectors();
  if (main.determinant() < 0.0) main.col(0) = -main.col(0);
  CapsuleFit best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& frame : {main, Eigen::Matrix3d(Eigen::Matrix3d::Identity())}) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d axes;
      axes << frame.col((k + 1) % 3), frame.col((k + 2) % 3), frame.col(k);
      for (const double wider : {1.0, 1.12}) {
        const CapsuleFit fit = fit_along(corners, axes, wider);
        const double found = cost(fit);
        if (found >= least) continue;
        least = found;
        best = fit;
      }
    }
  }
  return best;
}

double volume(const CapsuleFit& fit) {
  return fit.radius_m * fit.radius_m * (fit.length_m + 4.0 / 3.0 * fit.radius_m);
}

}  // namespace posed::robot
