#include "proto/rig/motion.hpp"

namespace posed::rig {
namespace {

bool fit(const Figure& figure, const RigPoses& poses) {
  constexpr double kMaxPosition = 1e9;
  const std::size_t count = static_cast<std::size_t>(figure.size()) * std::max(poses.count, 0);
  return poses.count > 0 && poses.rotation.size() == count && poses.position.size() == count &&
         std::ranges::all_of(poses.rotation,
                             [](const auto& q) { return std::abs(q.norm() - 1.0) < 1e-3; }) &&
         std::ranges::all_of(poses.position, [](const Vec& p) {
           return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxPosition;
         });
}

}  // namespace

Motion::Motion(const Figure& figure, const RigPoses& poses) : joints_(figure.size()) {
  const bool moves = fit(figure, poses);
  poses_ = moves ? poses.count : 1;
  world_.resize(index(poses_, 0));
  position_.resize(index(poses_, 0));
  for (int i = 0; i < poses_; ++i) {
    for (int j = 0; j < joints_; ++j) {
      const std::size_t at = index(i, j);
      const Mat local =
          moves ? poses.rotation[at].normalized().toRotationMatrix() : Mat(Mat::Identity());
      const Vec offset = moves ? poses.position[at] : figure[j].offset;
      const int parent = figure[j].parent;
      world_[at] = parent < 0 ? local : Mat(world(i, parent) * local);
      position_[at] = parent < 0 ? offset : Vec(position(i, parent) + world(i, parent) * offset);
    }
  }
}

}  // namespace posed::rig
