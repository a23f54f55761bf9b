#include "models/style/train/flips.hpp"

#include <algorithm>
#include <numbers>

#include "proto/frame/degree.hpp"
#include "proto/frame/median.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::style {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kFlip_rad = 90.0 * kDegree;  // a step of 90 degrees at 30 Hz is 2,700 deg/s
constexpr double kMaxFilled_s = 0.5;

double step_rad(const MatrixXd& q, Index t, Index d) {
  return angle_between_rad(rotation_exp(Eigen::Vector3d(q.block<1, 3>(t - 1, d).transpose())),
                           rotation_exp(Eigen::Vector3d(q.block<1, 3>(t, d).transpose())));
}

struct Flips {
  std::vector<bool> bad;  // [frames]
  Index first = 0;        // the frame of the first flip
  Index bad_frames = 0, longest = 0;
  double turn_rad = 0.0;  // of the largest one
};

// The parts between flips are alternately right and flipped; the ones that are fewer frames in all
// are the flipped ones.
Flips find_flips(const MatrixXd& q, Index d) {
  Flips flips{.bad = std::vector<bool>(static_cast<std::size_t>(q.rows()), false)};
  bool flipped = false;
  for (Index t = 1; t < q.rows(); ++t) {
    const double turn_rad = step_rad(q, t, d);
    if (turn_rad > kFlip_rad) {
      if (flips.turn_rad == 0.0) flips.first = t;
      flips.turn_rad = std::max(flips.turn_rad, turn_rad);
      flipped = !flipped;
    }
    flips.bad[static_cast<std::size_t>(t)] = flipped;
  }
  if (flips.turn_rad == 0.0) return flips;
  if (2 * std::ranges::count(flips.bad, true) > q.rows()) flips.bad.flip();
  Index run = 0;
  for (const bool bad : flips.bad) {
    run = bad ? run + 1 : 0;
    flips.bad_frames += bad ? 1 : 0;
    flips.longest = std::max(flips.longest, run);
  }
  return flips;
}

void fill_in(const std::vector<bool>& bad, Index d, MatrixXd& q) {
  for (Index t = 0; t < q.rows();) {
    if (!bad[static_cast<std::size_t>(t)]) {
      ++t;
      continue;
    }
    const Index begin = t;
    while (t < q.rows() && bad[static_cast<std::size_t>(t)]) ++t;
    const Index before = begin > 0 ? begin - 1 : t;
    const Index after = t < q.rows() ? t : begin - 1;
    for (Index i = begin; i < t; ++i) {
      const double share = static_cast<double>(i - begin + 1) / static_cast<double>(t - begin + 1);
      q.block<1, 3>(i, d) =
          (1.0 - share) * q.block<1, 3>(before, d) + share * q.block<1, 3>(after, d);
    }
  }
}

void leave_out(const std::vector<bool>& bad, Index d, MatrixXd& q) {
  for (Index axis = d; axis < d + 3; ++axis) {
    std::vector<double> good;
    for (Index t = 0; t < q.rows(); ++t) {
      if (!bad[static_cast<std::size_t>(t)]) good.push_back(q(t, axis));
    }
    q.col(axis).setConstant(median(good));
  }
}

bool carries_others(const motion::PoseSpace& space, int joint) {
  const Skeleton& skeleton = space.skeleton();
  for (int d = 0; d < space.dims(); d += 3) {
    const int other = space.skeleton_joint_of_dim(d);
    for (int j = other < 0 ? -1 : skeleton.joints[other].parent; j >= 0;
         j = skeleton.joints[j].parent) {
      if (j == joint) return true;
    }
  }
  return false;
}

// Angles that jump by a turn between two frames would be learnt as a motion that nobody made.
Result<> check_angles(const motion::PoseSpaceSpec& spec, const motion::PoseSpace& space,
                      const MatrixXd& q) {
  for (Index t = 1; t < q.rows(); ++t) {
    Index d = 0;
    if ((q.row(t) - q.row(t - 1)).cwiseAbs().maxCoeff(&d) <= std::numbers::pi) continue;
    const std::string& joint =
        spec.joints[static_cast<std::size_t>(space.joint_of_dim(static_cast<int>(d)))];
    return fail("joint " + clean_name(joint) + " turns over at frame " + std::to_string(t + 1) +
                " of the resampled clip; cut the clip there or, where Euler angles turn over "
                "(cmu43), use --pose-space native");
  }
  return {};
}

}  // namespace

Result<std::vector<std::string>> mend_flips(const motion::PoseSpaceSpec& spec,
                                            const motion::PoseSpace& space, double rate_hz,
                                            MatrixXd& q) {
  std::vector<std::string> mended;
  const bool has_vectors = spec.space != motion::Space::kCmu43;
  for (int d = 0; has_vectors && d < space.dims(); d += 3) {
    const Flips flips = find_flips(q, d);
    if (flips.turn_rad == 0.0) continue;
    const auto name = clean_name(spec.joints[static_cast<std::size_t>(space.joint_of_dim(d))]);
    std::string what = "joint " + name + " flips by " +
                       std::to_string(static_cast<int>(flips.turn_rad / kDegree)) +
                       " deg at frame " + std::to_string(flips.first + 1) + " at " +
                       std::to_string(static_cast<int>(rate_hz)) + " Hz";
    const bool is_short = static_cast<double>(flips.longest) <= kMaxFilled_s * rate_hz;
    if (!is_short && carries_others(space, space.skeleton_joint_of_dim(d))) {
      return fail(what + " and stays so; cut the clip there, or mend the joint in the studio");
    }
    if (is_short) {
      fill_in(flips.bad, d, q);
      what += "; " +
              (flips.bad_frames == 1 ? "one frame is"
                                     : std::to_string(flips.bad_frames) + " frames are") +
              std::string(" filled in from those beside");
    } else {
      leave_out(flips.bad, d, q);
      what += " and stays so; the joint is left out of this clip";
    }
    mended.push_back(std::move(what));
  }
  TRY(check_angles(spec, space, q));
  return mended;
}

}  // namespace posed::style
