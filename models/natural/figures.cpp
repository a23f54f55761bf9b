#include "models/natural/figures.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>

#include "models/feet/foot_score.hpp"
#include "proto/frame/degree.hpp"

namespace posed::natural {
namespace {

constexpr double kCentimetres = 100.0;  // of a metre
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::optional<double> in_cm(const std::optional<double>& metres) {
  return metres ? std::optional(kCentimetres * *metres) : std::nullopt;
}

std::optional<double> there(double number) {
  return number == number ? std::optional(number) : std::nullopt;  // not NaN
}

// From the hips outwards.
constexpr std::array kCompared{Bone::kHips,          Bone::kChest,         Bone::kHead,
                               Bone::kLeftUpperArm,  Bone::kLeftLowerArm,  Bone::kLeftHand,
                               Bone::kRightUpperArm, Bone::kRightLowerArm, Bone::kRightHand,
                               Bone::kLeftUpperLeg,  Bone::kLeftLowerLeg,  Bone::kLeftFoot,
                               Bone::kRightUpperLeg, Bone::kRightLowerLeg, Bone::kRightFoot};

// A limb is what lies between a joint and the next of these bones above it.
constexpr std::array kLimbEnds{Bone::kLeftLowerArm,  Bone::kLeftHand,     Bone::kRightLowerArm,
                               Bone::kRightHand,     Bone::kLeftLowerLeg, Bone::kLeftFoot,
                               Bone::kRightLowerLeg, Bone::kRightFoot};

Eigen::VectorXd limbs_of(const Skeleton& skeleton) {
  Eigen::VectorXd limbs_m = Eigen::VectorXd::Zero(kLimbEnds.size());
  for (std::size_t i = 0; i < kLimbEnds.size(); ++i) {
    int joint = skeleton.joint_of(kLimbEnds[i]);
    while (joint > 0) {
      limbs_m[static_cast<Eigen::Index>(i)] += skeleton.joints[joint].offset_m.norm();
      joint = skeleton.joints[joint].parent;
      if (skeleton.joints[joint].bone) break;
    }
  }
  return limbs_m;
}

}  // namespace

std::shared_ptr<const Skeleton> with_one_trunk(std::shared_ptr<const Skeleton> skeleton) {
  if (!motion::is_person(*skeleton)) return skeleton;
  auto one = std::make_shared<Skeleton>(*skeleton);
  int last = -1;
  for (const Bone bone : {Bone::kSpine, Bone::kChest, Bone::kUpperChest}) {
    const int joint = skeleton->joint_of(bone);
    if (joint < 0) continue;
    one->joints[joint].bone.reset();
    last = joint;
  }
  if (last >= 0) one->joints[last].bone = Bone::kChest;
  return one;
}

Result<motion::PoseSpaceSpec> compared_space(const Skeleton& skeleton) {
  if (!motion::is_person(skeleton)) return describe_space(motion::Space::kNative, skeleton);
  auto spec = TRY(describe_space(motion::Space::kHumanoid, skeleton));
  std::vector<std::string> others;
  for (const std::string& joint : spec.joints) {
    const auto bone = bone_from_name(joint);
    if (!bone || std::ranges::find(kCompared, *bone) == kCompared.end()) others.push_back(joint);
  }
  remove_joints(others, spec);
  return spec;
}

void remove_joints(const std::vector<std::string>& joints, motion::PoseSpaceSpec& spec) {
  const std::string root = spec.joints[static_cast<std::size_t>(spec.root)];
  for (const std::string& joint : joints) {
    const auto found = std::ranges::find(spec.joints, joint);
    if (found == spec.joints.end() || joint == root) continue;
    spec.mean.erase(spec.mean.begin() + (found - spec.joints.begin()));
    spec.joints.erase(found);
  }
  spec.root = static_cast<int>(std::ranges::find(spec.joints, root) - spec.joints.begin());
}

Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz) {
  Figures figures;
  figures.windows = motion::window_sums(angles_deg);
  if (motion::most_dimensions(figures.windows.count) < 1) {
    return fail("is too short: it has " + std::to_string(angles_deg.rows()) +
                " frames at this rate, and 49 are needed");
  }
  figures.jerk = motion::jerk_rms(angles_deg);
  const Eigen::VectorXd speed = motion::speed_of(angles_deg, rate_hz);
  figures.sparc =
      motion::spectral_arc_length(std::span(speed.data(), speed.data() + speed.size()), rate_hz);
  figures.low_deg = angles_deg.colwise().minCoeff().transpose();
  figures.high_deg = angles_deg.colwise().maxCoeff().transpose();
  return figures;
}

Result<Figures> figures_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec) {
  const auto space = motion::PoseSpace::bind_person(spec, *motion.skeleton);
  if (!space) return fail("its skeleton lacks joints of the clip");
  const motion::Rows angles_deg =
      motion::pose_vectors(motion, *space, motion::walk_heading_rad(motion)) / kDegree;
  auto figures = TRY(figures_of(angles_deg, motion.rate_hz));
  // The root turns against the world, which no joint limits.
  for (int d = 0; d < space->dims(); ++d) {
    if (space->joint_of_dim(d) == spec.root) figures.low_deg[d] = figures.high_deg[d] = 0.0;
  }
  if (spec.space == motion::Space::kHumanoid) {
    figures.limbs_m = limbs_of(*motion.skeleton);
    figures.lacks = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(spec.joints.size()));
    for (std::size_t j = 0; j < spec.joints.size(); ++j) {
      if (std::ranges::count(space->missing(), spec.joints[j]) > 0) {
        figures.lacks[static_cast<Eigen::Index>(j)] = 1.0;
      }
    }
  }
  figures.slide_cm_s = in_cm(feet::slide_m_s(motion, motion));
  figures.sink_cm = in_cm(feet::below_standing_m(motion));
  return figures;
}

void write(const Figures& figures, NumberWriter& numbers) {
  numbers.add(figures.jerk).add(figures.sparc);
  numbers.add(figures.windows.count).add(figures.windows.first).add(figures.windows.second);
  numbers.add(figures.low_deg).add(figures.high_deg);
  numbers.add(figures.slide_cm_s.value_or(kNone)).add(figures.sink_cm.value_or(kNone));
  numbers.add(figures.limbs_m).add(figures.lacks);
}

Figures figures_from(NumberReader& numbers) {
  Figures figures;
  figures.jerk = numbers.number();
  figures.sparc = numbers.number();
  figures.windows.count = numbers.number();
  figures.windows.first = numbers.vector();
  figures.windows.second = numbers.matrix();
  figures.low_deg = numbers.vector();
  figures.high_deg = numbers.vector();
  figures.slide_cm_s = there(numbers.number());
  figures.sink_cm = there(numbers.number());
  figures.limbs_m = numbers.vector();
  figures.lacks = numbers.vector();
  return figures;
}

}  // namespace posed::natural
