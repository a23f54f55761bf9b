#include "models/style/live/apply.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "models/feet/feet_stage.hpp"
#include "models/motion/heading.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/turn_sum.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/style/model/stride_phase.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::style {
namespace {

constexpr int kProgressEvery = 1000;  // frames
constexpr double kBeginning_s = 1.5;

// Keeps what the stage emits.
class Catch final : public StageOut {
 public:
  void frame(const StageFrame& styled) noexcept override { frame_ = styled.frame; }
  [[nodiscard]] const Frame& get() const { return frame_; }

 private:
  Frame frame_;
};

Result<> check_clip(const clip::Clip& clip) {
  if (clip.frames() == 0) return fail("has no frames to style", clip.path);
  if (!(clip.frame_rate_hz > 0.0)) return fail("has no frame rate", clip.path);
  for (int i = 0; i < clip.frames(); ++i) {
    if (clip.channels.row(i).allFinite()) continue;
    return fail("frame " + std::to_string(i + 1) + " holds a value that is not a number",
                clip.path);
  }
  return {};
}

// Lets the filter see the clip from its end back to the frame `first`, so that there it knows the
// motion and the direction that the walk takes from there, which is returned.
motion::LiveHeading settle(StyleFilter& filter, const clip::Clip& clip, int first,
                           const motion::PoseSpace& space) {
  const double frame_s = 1.0 / clip.frame_rate_hz;
  const auto beginning = std::lround(kBeginning_s * clip.frame_rate_hz);
  motion::LiveHeading heading;
  for (int i = clip.frames() - 1; i >= first; --i) {
    const Frame frame = clip.frame(i);
    if (space.has_heading(frame)) heading.update(space.heading_rad(frame), frame_s);
    if (i - first <= beginning) filter.preview(frame, heading, frame_s);
  }
  heading.turn_back();
  filter.settle(heading);
  return heading;
}

// The feet stage behind the style; without one, frames pass through.
class ThroughFeet final : public StageOut {
 public:
  explicit ThroughFeet(std::unique_ptr<Stage> feet) : feet_(std::move(feet)) {}

  void frame(const StageFrame& styled) noexcept override {
    if (feet_) {
      feet_->process(styled, caught_);
    } else {
      caught_.frame(styled);
    }
  }
  [[nodiscard]] const Frame& get() const { return caught_.get(); }

 private:
  std::unique_ptr<Stage> feet_;
  Catch caught_;
};

Result<std::unique_ptr<Stage>> feet_stage(const clip::Clip& clip, const ApplyOptions& options) {
  if (!options.feet) return nullptr;
  return feet::make_feet_stage(clip.skeleton, clip.frame_rate_hz, *options.feet);
}

// Moves the root of a clip by its position channels.
class RootWriter {
 public:
  // Returns an error for a clip whose root has no position channels.
  static Result<RootWriter> open(clip::Clip& clip) {
    RootWriter writer(clip);
    const Skeleton& skeleton = *clip.skeleton;
    for (int j = skeleton.root_joint; j >= 0; j = skeleton.joints[j].parent) {
      std::size_t count = 0;
      for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
        const Channel& channel = skeleton.channels[c];
        if (channel.joint != j || !channel.translation) continue;
        writer.column_[static_cast<std::size_t>(channel.axis)] = static_cast<Eigen::Index>(c);
        ++count;
      }
      writer.joint_ = j;
      if (count == 3) return writer;
    }
    return fail("its root has no position channels, so it cannot move; use --root off", clip.path);
  }

  // `frame` is the pose that the row has.
  void write(int row, const Frame& frame, const Eigen::Vector3d& offset_m) {
    const Skeleton& skeleton = *clip_.skeleton;
    Eigen::Quaterniond parent = Eigen::Quaterniond::Identity();
    for (int j = skeleton.joints[joint_].parent; j >= 0; j = skeleton.joints[j].parent) {
      parent = to_eigen_double(frame.rotation_xyzw[j]) * parent;
    }
    const Eigen::Vector3d local_m = parent.conjugate() * offset_m;
    for (std::size_t i = 0; i < 3; ++i) {
      clip_.channels(row, column_[i]) += local_m[static_cast<Eigen::Index>(i)];
    }
  }

 private:
  explicit RootWriter(clip::Clip& clip) : clip_(clip) {}

  clip::Clip& clip_;
  int joint_ = -1;
  std::array<Eigen::Index, 3> column_{};
};

Eigen::Vector3d root_step_m(const Frame& from, const Frame& to) {
  return Eigen::Vector3f(to.root_position_m.data()).cast<double>() -
         Eigen::Vector3f(from.root_position_m.data()).cast<double>();
}

// Writes the rotations that the style changed into the channels of a clip.
class ChannelWriter {
 public:
  explicit ChannelWriter(clip::Clip& clip) : clip_(clip) {}

  void write(int row, int joint, const Quatf& rotation) {
    const Skeleton& skeleton = *clip_.skeleton;
    const int near_row = std::max(row - 1, 0);
    std::array<Eigen::Index, 3> column{};
    std::array<double, 3> near_rad{};
    std::size_t count = 0;
    for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
      if (skeleton.channels[c].joint != joint || skeleton.channels[c].translation) continue;
      column[count] = static_cast<Eigen::Index>(c);
      near_rad[count] = clip_.channels(near_row, column[count]);
      ++count;
    }
    const auto angles =
        channels_from_rotation(skeleton, joint, to_eigen_double(rotation), near_rad);
    for (std::size_t i = 0; i < count; ++i) clip_.channels(row, column[i]) = angles[i];
  }

 private:
  clip::Clip& clip_;
};

// The walker's mean cycle, by the strides of the whole clip; without columns where it shows none.
// NaN where a joint was not always measured.
PoseCycle cycle_of_clip(const BoundModel& model, const clip::Clip& clip,
                        motion::LiveHeading heading) {
  const auto& legs = model.known->legs();
  const Eigen::Index dims = model.space.dims();
  if (!legs || !has_stride(clip.frames(), clip.frame_rate_hz)) return {};
  Eigen::MatrixXd q(clip.frames(), dims);
  Eigen::VectorXd leg(clip.frames());
  std::vector<std::uint8_t> available(static_cast<std::size_t>(dims));
  std::vector<float> pose(static_cast<std::size_t>(dims));
  Eigen::VectorXi gaps = Eigen::VectorXi::Zero(dims);
  for (int i = 0; i < clip.frames(); ++i) {
    const Frame frame = clip.frame(i);
    if (!legs->measured(frame) || !model.space.has_heading(frame)) return {};
    heading.update(model.space.heading_rad(frame), 1.0 / clip.frame_rate_hz);
    model.space.to_vector(frame, heading.value_rad(), pose, available);
    leg[i] = legs->value_rad(frame);
    for (Eigen::Index d = 0; d < dims; ++d) {
      q(i, d) = pose[static_cast<std::size_t>(d)];
      gaps[d] += available[static_cast<std::size_t>(d)] == 0 ? 1 : 0;
    }
  }
  const auto walk = walk_phases(leg, clip.frame_rate_hz);
  if (!walk) return {};
  const Eigen::MatrixXd kept = q(walk->frames, Eigen::all);
  PoseCycle cycle =
      (grid_basis() * fit_harmonics(walk->phase, kept, kCycleHarmonics)).cast<float>();
  for (Eigen::Index d = 0; d < dims; ++d) {
    if (gaps[d] > 0) cycle.col(d).setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  return cycle;
}

}  // namespace

Result<Walker> measure_walker(const StyleModel& model, const std::string& model_name,
                              const clip::Clip& clip) {
  TRY(check_clip(clip));
  const auto bound = TRY(bind_model(model, *clip.skeleton, model_name));
  if (!bound->known) {
    return fail("the model has no data for a warm-up: train it again with this version of posed",
                model_name);
  }
  StyleFilter filter(bound.get(), {.alpha = 0.0});
  const motion::LiveHeading heading = settle(filter, clip, 0, bound->space);
  const double seconds = (clip.frames() - 1.5) / clip.frame_rate_hz;  // ends at the last frame
  Catch ignored;
  for (int i = 0; i < clip.frames(); ++i) {
    const Frame in = clip.frame(i);
    if (i == 1) static_cast<void>(filter.command(StyleFilter::kWarmUp, StageCommand::of(seconds)));
    filter.process({.frame = in, .input = &in}, ignored);
  }
  if (filter.walker()) {
    Walker walker = *filter.walker();
    walker.cycle = cycle_of_clip(*bound, clip, heading);
    return walker;
  }
  return fail(
      "shows no walk for most of its time, so it does not say how the walker holds itself;"
      " give a clip of the walker's usual walk",
      clip.path);
}

Result<Applied> apply_to_clip(const StyleModel& model, const std::string& model_name,
                              const clip::Clip& clip, const ApplyOptions& options) {
  TRY(check_clip(clip));
  const auto bound = TRY(bind_model(model, *clip.skeleton, model_name));
  const BoundModel& ready = *bound;
  StyleFilter filter(&ready, options.filter);
  if (options.walker) filter.set_walker(*options.walker);
  const bool added_pose = !options.cold && motion::begins_with_added_pose(clip);
  const int first = added_pose ? 1 : 0;
  if (!options.cold) settle(filter, clip, first, ready.space);

  auto feet = feet_stage(clip, options);
  Applied applied{.clip = clip::is_acclaim(*clip.skeleton) ? clip::with_zyx_channels(clip) : clip,
                  .alpha = filter.held_alpha(),
                  .kept_first = added_pose,
                  .remark = ready.remark};
  ChannelWriter writer(applied.clip);
  auto root = RootWriter::open(applied.clip);
  const Error* const obstacle = !feet ? &feet.error() : !root ? &root.error() : nullptr;
  if (options.feet && obstacle != nullptr) {
    if (options.needs_feet) return std::unexpected(*obstacle);
    applied.no_feet = !feet ? "it has no leg with a foot" : "its root has no position channels";
  }
  motion::TurnSum turned;
  ThroughFeet out(applied.no_feet.empty() && feet ? std::move(*feet) : nullptr);
  double gates = 0.0;
  double estimates = 0.0;
  int estimated = 0;
  for (int i = first; i < clip.frames(); ++i) {
    const Frame in = clip.frame(i);
    filter.process({.frame = in, .input = &in}, out);
    gates += filter.gate();
    if (!std::isnan(filter.estimate())) {
      estimates += filter.estimate();
      ++estimated;
    }
    for (std::size_t j = 0; j < in.joint_count; ++j) {
      const Quatf& styled = out.get().rotation_xyzw[j];
      if (styled == in.rotation_xyzw[j]) continue;
      turned.add(j, in.rotation_xyzw[j], styled);
      writer.write(i, static_cast<int>(j), styled);
    }
    turned.end_frame();
    const Eigen::Vector3d offset_m = root_step_m(in, out.get());
    if (root && !offset_m.isZero(0.0)) root->write(i, in, offset_m);
    applied.max_root_offset_m = std::max(applied.max_root_offset_m, offset_m.norm());
    if (options.progress && i % kProgressEvery == 0 && !options.progress(i, clip.frames())) {
      return fail("stopped before its end", clip.path);
    }
  }
  applied.hinge_held = filter.hinge_held();
  if (estimated > 0) applied.estimate_mean = estimates / estimated;
  if (!std::isnan(gates)) applied.gate_mean = gates / (clip.frames() - first);
  applied.joints_changed = turned.joints();
  applied.rms_change_rad = turned.rms_rad();
  applied.max_change_rad = turned.max_rad();
  return applied;
}

}  // namespace posed::style
