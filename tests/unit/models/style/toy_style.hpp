// A skeleton of five joints, a walk and style models for it, small enough to reason about.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "models/gp/regression.hpp"
#include "models/style/live/style_filter.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::test {

inline constexpr double kPi = std::numbers::pi;

inline Skeleton toy_skeleton() {
  Skeleton skeleton;
  skeleton.name = "toy";
  const std::vector<std::string> names{"Hips", "Spine", "Head", "LeftLeg", "RightLeg"};
  const std::vector<int> parents{-1, 0, 1, 0, 0};
  for (std::size_t j = 0; j < names.size(); ++j) {
    Joint joint;
    joint.name = names[j];
    joint.parent = parents[j];
    joint.offset_m =
        j < 3 ? Eigen::Vector3d(0, 0.3, 0) : Eigen::Vector3d(j == 3 ? .1 : -.1, -.4, 0);
    if (j > 1) joint.end_site_m = Eigen::Vector3d(0, j == 2 ? 0.2 : -0.4, 0);
    skeleton.joints.push_back(joint);
  }
  for (std::uint16_t j = 0; j < 5; ++j) {
    if (j == 0) {
      for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
        skeleton.channels.push_back({.joint = 0, .axis = axis, .translation = true});
      }
    }
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      skeleton.channels.push_back({.joint = j, .axis = axis});
    }
  }
  skeleton.finish().value();
  return skeleton;
}

// A walk with one cycle per second, sampled at `rate_hz`, in the direction `heading_rad`.
inline clip::Clip toy_walk(int frames, double rate_hz = 60.0, double heading_rad = 0.0) {
  clip::Clip clip;
  clip.path = "toy.bvh";
  clip.skeleton = std::make_shared<const Skeleton>(toy_skeleton());
  clip.frame_rate_hz = rate_hz;
  clip.channels.setZero(frames, 18);
  for (int i = 0; i < frames; ++i) {
    const double t = i / rate_hz;
    const double phase = 2 * kPi * t;
    auto row = clip.channels.row(i);
    row[0] = std::sin(heading_rad) * t;
    row[1] = 0.9 + 0.02 * std::cos(2 * phase);
    row[2] = std::cos(heading_rad) * t;
    row[5] = heading_rad + 0.1 * std::sin(phase);
    for (int c = 6; c < 18; ++c) row[c] = 0.3 * std::sin(phase + c) + 0.02 * c;
  }
  return clip;
}

// A model with 20 training poses of the walk; `seed` selects the style, `size_rad` its size.
inline style::StyleModel toy_model(unsigned seed, double size_rad = 0.3) {
  style::StyleModel model;
  const Skeleton skeleton = toy_skeleton();
  model.space = motion::describe_space(motion::Space::kNative, skeleton).value();
  const auto space = motion::PoseSpace::bind(model.space, skeleton).value();
  const clip::Clip walk = toy_walk(20, 20.0);
  Eigen::MatrixXd X(20, 15);
  Eigen::MatrixXd Y(20, 15);
  for (int i = 0; i < 20; ++i) {
    std::vector<float> q(15);
    std::vector<std::uint8_t> available(15);
    space.to_vector(walk.frame(i), 0.0, q, available);
    for (int d = 0; d < 15; ++d) {
      X(i, d) = q[static_cast<std::size_t>(d)];
      Y(i, d) = size_rad * std::sin(seed * 1.7 + d * 2.3 + (d == 1 ? 0.0 : 0.3 * i * kPi / 10.0));
    }
  }
  const gp::Hyper hyper{0.0, 0.0, -std::numeric_limits<double>::infinity(), std::log(1e-3)};
  model.process = gp::fit(X, Y, Y.colwise().mean(), hyper).value();
  model.limit_rad = 1.5 * Y.cwiseAbs().colwise().maxCoeff().transpose();
  model.from = "toy";
  model.to = "other";
  return model;
}

// The style of toy_model(seeds[0]), named "s<seed>", and on the same poses those of the other
// seeds.
inline style::StyleModel toy_styles(const std::vector<unsigned>& seeds, double size_rad = 0.3) {
  style::StyleModel model = toy_model(seeds.front(), size_rad);
  model.to = "s" + std::to_string(seeds.front());
  for (std::size_t i = 1; i < seeds.size(); ++i) {
    style::StyleModel other = toy_model(seeds[i], size_rad);
    model.more.push_back({"s" + std::to_string(seeds[i]),
                          {std::move(other.process.weights), std::move(other.process.offset)},
                          std::move(other.limit_rad)});
  }
  return model;
}

// The same with what the gate, the warm-up and auto-alpha need. The toy names no upper legs, so
// that its poses alone tell what is known.
inline style::StyleModel gated_toy_model(unsigned seed, double size_rad = 0.3) {
  style::StyleModel model = toy_model(seed, size_rad);
  model.gate.neutral = model.process.inputs.colwise().mean();
  model.axis = {Eigen::VectorXd::Unit(15, 4), -model.gate.neutral[4]};
  return model;
}

inline Eigen::Quaterniond delta_of(const Frame& in, const Frame& out, int joint) {
  const auto j = static_cast<std::size_t>(joint);
  return to_eigen_double(in.rotation_xyzw[j]).conjugate() * to_eigen_double(out.rotation_xyzw[j]);
}

}  // namespace posed::test
