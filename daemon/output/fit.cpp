#include "daemon/output/fit.hpp"

#include <algorithm>
#include <utility>

#include "proto/frame/rotation.hpp"

namespace posed::output {
namespace {

// Frames of a figure with channels get the angles of all of them, which no output reads.
std::shared_ptr<const Skeleton> without_channels(const Skeleton& figure) {
  auto bare = std::make_shared<Skeleton>(figure);
  bare->channels.clear();
  return bare;
}

}  // namespace

Result<Fit> Fit::make(std::shared_ptr<const Skeleton> person, bool own, const MakeFigure& figure) {
  if (person == nullptr) return fail("it has no pose");
  Fit fit;
  if (own) {
    for (std::size_t j = 0; j < person->joints.size(); ++j) {
      fit.rest_xyzw_.push_back(from_eigen(local_from_canonical(*person, j)));
    }
    fit.skeleton_ = std::move(person);
    return fit;
  }
  const auto average = TRY(figure(1.0));
  const auto to_average = TRY(motion::Retarget::bind(person, average));
  fit.skeleton_ = TRY(figure(1.0 / to_average.scale()));
  fit.retarget_ = TRY(motion::Retarget::bind(std::move(person), without_channels(*fit.skeleton_)));
  return fit;
}

const Frame& Fit::apply(const Frame& frame) noexcept {
  if (retarget_) {
    retarget_->apply(frame, pose_);
    return pose_;
  }
  pose_ = frame;
  for (std::size_t j = 0; j < rest_xyzw_.size(); ++j) {
    if (!frame.valid[j]) pose_.rotation_xyzw[j] = rest_xyzw_[j];
  }
  return pose_;
}

std::string distinct_name(const std::string& own, const std::string& stream, std::size_t place,
                          std::vector<std::string>& names) {
  names[place].clear();
  const auto is_free = [&](const std::string& name) {
    return std::ranges::find(names, name) == names.end();
  };
  std::string name = is_free(own) ? own : stream;
  for (int number = 2; !is_free(name); ++number) name = stream + "-" + std::to_string(number);
  names[place] = name;
  return name;
}

bool has_fingers(const Skeleton& skeleton) {
  return skeleton.joint_of(Bone::kLeftIndexProximal) >= 0 ||
         skeleton.joint_of(Bone::kRightIndexProximal) >= 0;
}

bool rests_unturned(const Skeleton& skeleton) noexcept {
  constexpr double kUnturned_rad = 1e-4;
  return skeleton.root_joint == 0 && std::ranges::all_of(skeleton.joints, [](const Joint& joint) {
           return joint.T_world_joint.angularDistance(Eigen::Quaterniond::Identity()) <
                  kUnturned_rad;
         });
}

}  // namespace posed::output
