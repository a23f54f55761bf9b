#include "models/motion/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "models/motion/leg_signal.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::motion {
namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinChord_m = 0.5;
constexpr double kSameRate = 1e-3;  // relative

Quaterniond rotation(const Frame& frame, int joint) {
  return to_eigen_double(frame.rotation_xyzw[joint]);
}

Quaterniond world_rotation(const Skeleton& skeleton, const Frame& frame, int joint) {
  Quaterniond world = Quaterniond::Identity();
  for (int j = joint; j >= 0; j = skeleton.joints[j].parent) world = rotation(frame, j) * world;
  return world;
}

// Joint rotations as columns of quaternion components whose signs never jump, followed by the root
// position. Such columns may be filtered one by one.
MatrixXd to_columns(const Motion& motion) {
  const int joints = motion.frames.front().joint_count;
  MatrixXd columns(motion.size(), 4 * joints + 3);
  for (int t = 0; t < motion.size(); ++t) {
    const Frame& frame = motion.frames[t];
    for (int j = 0; j < joints; ++j) {
      Eigen::Vector4d q = rotation(frame, j).coeffs();
      if (t > 0 && q.dot(columns.block<1, 4>(t - 1, 4 * j)) < 0.0) q = -q;
      columns.block<1, 4>(t, 4 * j) = q;
    }
    for (int i = 0; i < 3; ++i) columns(t, 4 * joints + i) = frame.root_position_m[i];
  }
  return columns;
}

// The frame at `position` (in frames) of `columns`: slerp between neighbours.
void fill_frame(const MatrixXd& columns, double position, Frame& frame) {
  const auto last = static_cast<int>(columns.rows()) - 1;
  const int low = std::clamp(static_cast<int>(position), 0, last);
  const int high = std::min(low + 1, last);
  const double part = std::clamp(position - low, 0.0, 1.0);
  const int joints = frame.joint_count;
  for (int j = 0; j < joints; ++j) {
    const Quaterniond a(Eigen::Vector4d(columns.block<1, 4>(low, 4 * j).normalized()));
    const Quaterniond b(Eigen::Vector4d(columns.block<1, 4>(high, 4 * j).normalized()));
    frame.rotation_xyzw[j] = from_eigen(a.slerp(part, b));
  }
  for (int i = 0; i < 3; ++i) {
    const double value =
        (1.0 - part) * columns(low, 4 * joints + i) + part * columns(high, 4 * joints + i);
    frame.root_position_m[i] = static_cast<float>(value);
  }
}

constexpr int kOrder = 4;
constexpr int kPadding = 3 * (kOrder + 1);  // frames, scipy's default for five coefficients

// One second-order section, transposed direct form II, gain 1 at frequency 0.
struct Section {
  double b0, b1, b2, a1, a2;

  void run(Eigen::Ref<Eigen::VectorXd> x) const {
    // The initial state for which a constant input of x[0] gives a constant output.
    double z1 = (1.0 - b0) * x[0];
    double z2 = (b2 - a2) * x[0];
    for (double& value : x) {
      const double y = b0 * value + z1;
      z1 = b1 * value - a1 * y + z2;
      z2 = b2 * value - a2 * y;
      value = y;
    }
  }
};

// The bilinear transform of the analogue Butterworth pole pairs, cutoff prewarped.
std::array<Section, kOrder / 2> butterworth(double cutoff) {
  const double w = std::tan(0.5 * std::numbers::pi * cutoff);
  std::array<Section, kOrder / 2> sections{};
  for (int k = 0; k < kOrder / 2; ++k) {
    const double damping = 2.0 * std::sin(std::numbers::pi * (2 * k + 1) / (2.0 * kOrder));
    const double a0 = 1.0 + damping * w + w * w;
    sections[k] = {w * w / a0, 2.0 * w * w / a0, w * w / a0, 2.0 * (w * w - 1.0) / a0,
                   (1.0 - damping * w + w * w) / a0};
  }
  return sections;
}

}  // namespace

bool begins_with_added_pose(const Motion& motion) {
  return clip::begins_with_added_pose(motion.size(), motion.skeleton->root_joint,
                                      [&](int t) -> const Frame& { return motion.frames[t]; });
}

bool begins_with_added_pose(const clip::Clip& clip) { return clip::begins_with_added_pose(clip); }

Result<Motion> performed_motion_of(const clip::Clip& clip) {
  auto motion = TRY(motion_of(clip));
  if (begins_with_added_pose(motion)) drop_first_frame(motion);
  return motion;
}

void drop_first_frame(Motion& motion) { motion.frames.erase(motion.frames.begin()); }

Result<Motion> motion_of(const clip::Clip& clip) {
  if (clip.frames() == 0)
    return fail("the clip has no frames; record at least one stride", clip.path);
  if (!(clip.frame_rate_hz > 0.0)) return fail("the clip has no frame rate", clip.path);
  Motion motion{clip.skeleton, clip.frame_rate_hz, {}};
  motion.frames.reserve(clip.frames());
  for (int t = 0; t < clip.frames(); ++t) {
    if (!clip.channels.row(t).allFinite()) {
      return fail("frame " + std::to_string(t + 1) +
                      " holds a value that is not a number; mend or "
                      "cut the clip",
                  clip.path);
    }
    motion.frames.push_back(clip.frame(t));
  }
  return motion;
}

Motion resample(const Motion& motion, double rate_hz) {
  if (motion.size() < 2 || std::abs(motion.rate_hz / rate_hz - 1.0) < kSameRate) return motion;
  MatrixXd columns = to_columns(motion);
  const double step = motion.rate_hz / rate_hz;
  if (step > 1.0) {
    columns = low_pass_zero_phase(columns, 2.0 * (rate_hz / 3.0) / motion.rate_hz);
  }
  // A rate such as 119.88 Hz is 120 Hz within the accuracy of clocks, so the step stays a whole
  // number.
  const double whole = std::round(step);
  const double exact = std::abs(step - whole) < kSameRate * step ? whole : step;
  Motion out{motion.skeleton, rate_hz, {}};
  const auto count = static_cast<int>(std::floor((motion.size() - 1) / exact + 1e-9)) + 1;
  for (int k = 0; k < count; ++k) {
    Frame frame =
        motion.frames[std::min(motion.size() - 1, static_cast<int>(std::lround(k * exact)))];
    fill_frame(columns, k * exact, frame);
    frame.angle_count = 0;  // channel angles are not resampled, because training does not read them
    out.frames.push_back(frame);
  }
  return out;
}

double walk_heading_rad(const Motion& motion) {
  const Skeleton& skeleton = *motion.skeleton;
  const auto& first = motion.frames.front().root_position_m;
  const auto& last = motion.frames.back().root_position_m;
  const double dx = static_cast<double>(last[0]) - first[0];
  const double dz = static_cast<double>(last[2]) - first[2];
  if (std::hypot(dx, dz) >= kMinChord_m) return std::atan2(dx, dz);
  const Quaterniond T_inverse = skeleton.joints[skeleton.root_joint].T_world_joint.conjugate();
  Vector3d forward = Vector3d::Zero();
  for (const Frame& frame : motion.frames) {
    forward += world_rotation(skeleton, frame, skeleton.root_joint) * T_inverse * Vector3d::UnitZ();
  }
  return std::atan2(forward.x(), forward.z());
}

MatrixXd root_positions_m(const Motion& motion, double heading_rad) {
  const Quaterniond turn = axis_rotation(Axis::kY, -heading_rad);
  MatrixXd positions(motion.size(), 3);
  for (int t = 0; t < motion.size(); ++t) {
    const auto& p = motion.frames[t].root_position_m;
    positions.row(t) = (turn * Vector3d(p[0], p[1], p[2])).transpose();
  }
  return positions;
}

MatrixXd pose_vectors(const Motion& motion, const PoseSpace& space, double heading_rad) {
  const int dims = space.dims();
  MatrixXd q(motion.size(), dims);
  std::vector<float> row(dims);
  std::vector<std::uint8_t> available(dims);
  for (int t = 0; t < motion.size(); ++t) {
    space.to_vector(motion.frames[t], heading_rad, row, available);
    q.row(t) = Eigen::Map<const Eigen::RowVectorXf>(row.data(), dims).cast<double>();
  }
  return q;
}

// The mean rotation of each joint: the eigenvector of the summed outer products of quaternions.
Result<> set_mean_rotations(std::span<const Motion* const> motions, PoseSpaceSpec& spec) {
  if (spec.mean.empty()) return {};
  std::vector<Eigen::Matrix4d> sums(spec.mean.size(), Eigen::Matrix4d::Zero());
  for (const Motion* motion : motions) {
    const auto space = TRY(PoseSpace::bind(spec, *motion->skeleton));
    const MatrixXd q = pose_vectors(*motion, space, walk_heading_rad(*motion));
    for (int j = 0; j < std::ssize(spec.mean); ++j) {
      for (int t = 0; t < q.rows(); ++t) {
        const Vector3d v = q.block<1, 3>(t, 3 * j).transpose();
        const Eigen::Vector4d c = (spec.mean[j] * rotation_exp(v)).coeffs();
        sums[j] += c * c.transpose() / static_cast<double>(q.rows());
      }
    }
  }
  for (std::size_t j = 0; j < spec.mean.size(); ++j) {
    spec.mean[j] =
        Quaterniond(Eigen::Vector4d(symmetric_eigen(sums[j]).vectors.col(3))).normalized();
  }
  return {};
}

std::optional<VectorXd> leg_signal(const Motion& motion) {
  const auto legs = LegSignal::find(*motion.skeleton);
  if (!legs) return std::nullopt;
  VectorXd signal(motion.size());
  for (int t = 0; t < motion.size(); ++t) signal[t] = legs->value_rad(motion.frames[t]);
  return signal;
}

MatrixXd time_derivative(const MatrixXd& values, double rate_hz) {
  const auto last = static_cast<int>(values.rows()) - 1;
  MatrixXd rate = MatrixXd::Zero(values.rows(), values.cols());
  if (last < 1) return rate;
  rate.row(0) = values.row(1) - values.row(0);
  rate.row(last) = values.row(last) - values.row(last - 1);
  if (last > 1) {
    rate.middleRows(1, last - 1) = 0.5 * (values.bottomRows(last - 1) - values.topRows(last - 1));
  }
  return rate * rate_hz;
}

Eigen::MatrixXd low_pass_zero_phase(const Eigen::MatrixXd& signal, double cutoff) {
  const auto frames = static_cast<int>(signal.rows());
  if (frames < 2) return signal;
  const auto sections = butterworth(cutoff);
  const int pad = std::min(kPadding, frames - 1);
  Eigen::MatrixXd filtered(frames, signal.cols());
  Eigen::VectorXd x(frames + 2 * pad);
  for (int c = 0; c < signal.cols(); ++c) {
    const auto column = signal.col(c);
    x.head(pad) = 2.0 * column[0] - column.segment(1, pad).reverse().array();
    x.segment(pad, frames) = column;
    x.tail(pad) =
        2.0 * column[frames - 1] - column.segment(frames - 1 - pad, pad).reverse().array();
    for (int pass = 0; pass < 2; ++pass) {
      for (const Section& section : sections) section.run(x);
      x.reverseInPlace();
    }
    filtered.col(c) = x.segment(pad, frames);
  }
  return filtered;
}

}  // namespace posed::motion
