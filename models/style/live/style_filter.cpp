#include "models/style/live/style_filter.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "models/style/live/warm_up.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMaxStep_s = 0.1;
constexpr double kUnknownReading = std::numeric_limits<double>::quiet_NaN();
constexpr double kTold_rad = 5.0 * kDegree;  // of a hinge that is held
constexpr double kNoTurn_rad = 1e-6;         // too small for single precision

bool usable(const Quatf& q) noexcept {
  const float norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return norm2 > 1e-6F && norm2 < 1e6F;  // false when not finite
}

// A joint whose quaternion is not a rotation counts as not measured, whatever its flag says.
RT_SAFE void drop_broken_joints(Frame& frame) noexcept {
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    if (usable(frame.rotation_xyzw[j])) continue;
    frame.valid[j] = false;
    frame.rotation_xyzw[j] = kIdentity;
  }
}

}  // namespace

StyleFilter::StyleFilter(const BoundModel* model, const FilterOptions& options,
                         std::shared_ptr<const Skeleton> skeleton) noexcept
    : model_(model), skeleton_(std::move(skeleton)), options_(options) {
  options_.alpha_slew_per_s = std::clamp(options.alpha_slew_per_s, 1e-3, 1e6);
  set_alpha(static_cast<float>(options.alpha));
  tracker_.set_auto_alpha(options.auto_alpha);
  missing_ = options.auto_alpha ? 0.0 : 1.0;
  tracker_.set_gate(options.gate);
  mask_.begin(options.mask);
  if (model == nullptr) return;
  weights_.begin(
      shares_of(options.weights, model->styles()).value_or(first_alone(model->styles().size())));
  for (int i = 0; i < gp::Predictor::kSettleCalls; ++i) {
    static_cast<void>(model->predictor.settle(weights_.shares()));
  }
  mix_limits();
}

RT_SAFE void StyleFilter::set_alpha(float alpha) noexcept {
  if (!std::isfinite(alpha)) return;
  alpha_target_ = std::clamp(static_cast<double>(alpha), -kMaxAlpha, kMaxAlpha);
}

RT_SAFE bool StyleFilter::set_shares(const Shares& shares) noexcept {
  if (model_ == nullptr || shares.count != model_->styles().size()) return false;
  weights_.aim(shares);
  return true;
}

RT_SAFE const BoundModel* StyleFilter::set_model(const BoundModel* model) noexcept {
  if (model == nullptr && model_ == nullptr) return nullptr;
  discontinuity_ = true;
  hinge_held_ = false;
  leaving_ = model == nullptr;
  if (leaving_) return take_away();
  tracker_.exchange(model_, *model);
  if (model_ == nullptr) {
    weights_.begin(first_alone(model->styles().size()));
  } else {
    weights_.rename(model_->styles(), model->styles());
  }
  const BoundModel* const before = std::exchange(model_, model);
  mix_limits();
  return before;
}

// A next model fades in as a first one does. What is known of the walker is in the terms of this
// one.
RT_SAFE const BoundModel* StyleFilter::take_away() noexcept {
  leaving_root_ = last_joints_ > 0 && model_->has_root ? root_change_ : RootChange{};
  tracker_.forget();
  weights_.begin(first_alone(1));
  is_held_ = tell_held_ = tell_hinge_ = false;
  reach_ = {};
  alpha_ = 0.0;
  return std::exchange(model_, nullptr);
}

const StyleFilter::Table& StyleFilter::table() {
  static const Table table({
      Table::row<&FilterOptions::alpha>(
          {.name = "alpha",
           .help = "how much style: 0 none, 1 as trained, 2 twice as much, -1 the opposite",
           .min = -kMaxAlpha,
           .max = kMaxAlpha,
           .live = true},
          {.set = &StyleFilter::set_alpha_number, .state = &StyleFilter::alpha_state}),
      Table::row<&FilterOptions::alpha_slew_per_s>({.name = "alpha_slew_per_s",
                                                    .help = "how fast alpha moves to a new value",
                                                    .min = 0.01,
                                                    .max = 1000.0,
                                                    .live = true}),
      Table::row<&FilterOptions::gate>(
          {.name = "gate",
           .help = "fade the style out where the model does not know the motion",
           .live = true},
          {.set = &StyleFilter::set_gate}),
      Table::row<&FilterOptions::gate_fallback>(
          {.name = "gate_fallback",
           .help = "what the gate fades to: 0 the input, 1 the model's constant part",
           .min = 0.0,
           .max = 1.0,
           .live = true},
          {.set = &StyleFilter::set_gate_fallback}),
      Table::row<&FilterOptions::auto_alpha>(
          {.name = "auto_alpha",
           .help = "less style for a walker who shows it already",
           .live = true},
          {.set = &StyleFilter::set_auto_alpha}),
      // The first command of the stage comes from these two (style_type()).
      {.spec = {.name = "warm_up_s",
                .default_value = 0.0,
                .help = "measure the walker's own neutral pose so long at the start; 0: do not",
                .min = 0.0,
                .max = kMaxWarmUp_s}},
      {.spec = {.name = "neutral",
                .default_value = std::string(),
                .is_path = true,
                .help = "a clip of the walker's usual walk, in the place of a warm-up"}},
      Table::row<&FilterOptions::weights>(
          {.name = "weights",
           .help = "how much of each style of the model: \"feminine=0.6,elderly=0.4\"; empty: the"
                   " first alone",
           .live = true}),
      {.spec = {.name = "mask",
                .default_value = std::string(),
                .help =
                    "how much of the style parts of the body get: \"arms=0.5,head=0\"; the rest 1",
                .live = true},
       .read =
           [](FilterOptions& options, const std::string& text) {
             options.mask = mask_of(text).value_or(whole_body());
           }},
  });
  return table;
}

RT_SAFE bool StyleFilter::use(const StageModel* model) noexcept {
  static_cast<void>(set_model(static_cast<const BoundModel*>(model)));
  return true;
}

RT_SAFE void StyleFilter::describe(std::size_t index, const StageCommand& command,
                                   ShortText& text) const noexcept {
  if (index == kMask) describe_mask(command.as<Mask>(), text);
  if (index == kWeights && model_ != nullptr) {
    describe_shares(command.as<Shares>(), model_->styles(), text);
  }
}

float StyleFilter::alpha() const noexcept { return static_cast<float>(alpha_); }

RT_SAFE bool StyleFilter::command(std::size_t index, const StageCommand& command) noexcept {
  switch (index) {
    case kWarmUp:
      return tracker_.warm_up(model_, command.as<double>());
    case kWeights:
      return set_shares(command.as<Shares>());
    case kMask:
      set_mask(command.as<Mask>());
      return true;
    case kNeutral:
      if (!tracker_.know(model_, walker_of(command))) return false;
      discontinuity_ = true;
      return true;
    default:
      return false;
  }
}

// The constant part of the model jumps with the fallback.
RT_SAFE void StyleFilter::set_gate_fallback(double value) noexcept {
  discontinuity_ = discontinuity_ || value != options_.gate_fallback;
}

// Who shows the style already gets the rest of it.
RT_SAFE double StyleFilter::wanted_alpha() const noexcept { return held_alpha() * missing_; }

// While nothing is known of how much the walker shows, it stays as it was.
RT_SAFE void StyleFilter::find_missing() noexcept {
  const bool reported = options_.auto_alpha && model_ != nullptr && model_->axis.size() > 0;
  const double shown = reported ? tracker_.estimate() : 0.0;
  if (!std::isnan(shown)) missing_ = std::clamp(1.0 - shown, 0.0, 1.0);
}

RT_SAFE double StyleFilter::gate() const noexcept {
  const bool gated = options_.gate && model_ != nullptr && model_->known;
  return gated ? static_cast<double>(tracker_.open()) : kUnknownReading;
}

RT_SAFE double StyleFilter::reading(std::size_t reading) const noexcept {
  return reading == kStyleGate ? gate() : estimate();
}

void StyleFilter::settle(const motion::LiveHeading& heading) noexcept {
  tracker_.settle();
  find_missing();
  alpha_ = wanted_alpha();
  heading_ = heading;
}

RT_SAFE void StyleFilter::preview(const Frame& frame, const motion::LiveHeading& heading,
                                  double dt_s) noexcept {
  if (model_ == nullptr || frame.skeleton != model_->space.skeleton().id) return;
  heading_ = heading;
  gap_s_ = dt_s;
  Pose pose;
  static_cast<void>(read_pose(frame, dt_s, pose));
}

RT_SAFE void StyleFilter::process(const StageFrame& in, StageOut& out) noexcept {
  Frame frame = in.frame;
  drop_broken_joints(frame);
  gap_s_ = elapsed_.next_s(frame.header);
  const double dt_s = std::min(gap_s_, kMaxStep_s);
  const double slew = options_.alpha_slew_per_s * dt_s;
  find_missing();
  look_at_reach();
  // Without a model there is no style yet, so that the first one fades in.
  if (model_ != nullptr) alpha_ += std::clamp(wanted_alpha() - alpha_, -slew, slew);
  blend_weight_ = std::max(0.0, blend_weight_ - slew);
  mask_.move(slew);
  if (weights_.moving()) {
    weights_.move(slew);
    mix_limits();
  }
  const bool served = model_ != nullptr && frame.skeleton == model_->space.skeleton().id;
  root_.setZero();
  if (served) {
    style(frame, dt_s);
  } else if (leaving_ && skeleton_ != nullptr && frame.skeleton == skeleton_->id) {
    fade_out(frame, dt_s);
  } else {
    last_joints_ = 0;  // the pose is that of another body, so there is nothing to blend from
    leaving_ = false;
  }
  const bool roots = leaving_ || (served && model_->has_root);
  if (roots && !leaving_) change_root();
  out.frame({.frame = frame,
             .variance_rad2 = in.variance_rad2,
             .input = in.input,
             .root = roots ? &root_change_ : nullptr});
}

// What the model sees of a frame. Returns whether that has changed suddenly.
RT_SAFE bool StyleFilter::read_pose(const Frame& frame, double dt_s, Pose& pose) noexcept {
  const std::size_t dims = model_->space.dims();
  model_->space.to_vector(frame, heading_.value_rad(), {pose.q.data(), dims},
                          {pose.available.data(), dims});
  return tracker_.see(*model_, frame, {pose.q.data(), dims}, {pose.available.data(), dims}, gap_s_,
                      dt_s, {pose.input.data(), dims});
}

// What the model added when it was taken away is added less and less.
RT_SAFE void StyleFilter::fade_out(Frame& frame, double dt_s) noexcept {
  const Rotations in = frame.rotation_xyzw;
  if (std::exchange(discontinuity_, false)) begin_blend(in, frame, dt_s);
  leaving_ = blend_weight_ > 0.0;
  blend(*skeleton_, frame);
  last_joints_ = leaving_ ? frame.joint_count : 0;
  last_in_ = in;
  last_out_ = frame.rotation_xyzw;
  const auto left = static_cast<float>(blend_weight_);
  last_root_ = left * root_from_;
  root_change_ = {.height_m = left * leaving_root_.height_m, .velocity_m_s = {}};
  for (std::size_t i = 0; i < root_change_.velocity_m_s.size(); ++i) {
    root_change_.velocity_m_s[i] = left * leaving_root_.velocity_m_s[i];
  }
}

RT_SAFE void StyleFilter::style(Frame& frame, double dt_s) noexcept {
  const motion::PoseSpace& space = model_->space;
  if (space.has_heading(frame) && heading_.update(space.heading_rad(frame), dt_s)) {
    discontinuity_ = true;
  }
  const Rotations in = frame.rotation_xyzw;
  Pose pose;
  if (read_pose(frame, dt_s, pose)) discontinuity_ = true;
  if (alpha_ != 0.0) change(in, pose, frame);
  if (std::exchange(discontinuity_, false)) begin_blend(in, frame, dt_s);
  blend(space.skeleton(), frame);
  last_joints_ = frame.joint_count;
  last_in_ = in;
  last_out_ = frame.rotation_xyzw;
}

// A walker of another build gets the change that the walk of training gets, bone by bone.
RT_SAFE void StyleFilter::change(const Rotations& in, const Pose& pose, Frame& frame) noexcept {
  const std::size_t dims = model_->space.dims();
  Dims delta, shares;
  answer(pose, delta, shares);
  if (model_->turns && tracker_.shifts()) {
    model_->turns->add(frame, heading_.value_rad(), {pose.input.data(), dims}, {delta.data(), dims},
                       {shares.data(), dims});
  } else {
    for (std::size_t d = 0; d < dims; ++d) delta[d] *= shares[d];
    model_->space.add(frame, heading_.value_rad(), {pose.q.data(), dims}, {delta.data(), dims});
  }
  if (model_->hinges.hold(in, frame) > kTold_rad && !std::exchange(hinge_held_, true)) {
    tell_hinge_ = true;
  }
}

// Empty while the predictor has the mixture ready.
RT_SAFE std::span<const float> StyleFilter::shares_to_ask() noexcept {
  if (weights_.moving() || !model_->predictor.settle(weights_.shares())) return weights_.shares();
  return {};
}

RT_SAFE void StyleFilter::mix_limits() noexcept {
  const Eigen::VectorXf& first = model_->limit_rad;
  const std::span<const float> shares = weights_.shares();
  for (Eigen::Index d = 0; d < first.size(); ++d) {
    float limit = shares[0] * first[d];
    for (std::size_t s = 1; s < shares.size(); ++s) {
      limit += shares[s] * model_->more_limits_rad[s - 1][d];
    }
    limit_rad_[d] = limit;
  }
  limit_root_.setZero();
  for (std::size_t s = 0; s < model_->root_limits.size(); ++s) {
    limit_root_ += shares[s] * model_->root_limits[s];
  }
  reach_ = model_->reach.empty() ? AlphaReach{} : AlphaReach{.low = 0.0, .high = 0.0};
  for (std::size_t s = 0; s < model_->reach.size(); ++s) {
    reach_.low += static_cast<double>(shares[s]) * model_->reach[s].low;
    reach_.high += static_cast<double>(shares[s]) * model_->reach[s].high;
  }
}

// Told once each time that it begins.
RT_SAFE void StyleFilter::look_at_reach() noexcept {
  const bool was_held = std::exchange(is_held_, held_alpha() != alpha_target_);
  tell_held_ = tell_held_ || (is_held_ && !was_held);
}

RT_SAFE std::optional<StageNotice> StyleFilter::take_notice() noexcept {
  if (std::exchange(tell_held_, false)) return StageNotice{.index = kAlphaHeld};
  if (std::exchange(tell_hinge_, false)) return StageNotice{.index = kHingeHeld};
  return tracker_.take_notice();
}

// The model delta: alpha times the mixture of styles, gated and clamped; `shares`: how much of it
// the mask lets pass, and what a part does that walks.
RT_SAFE void StyleFilter::answer(const Pose& pose, Dims& delta, Dims& shares) noexcept {
  const gp::Predictor& predictor = model_->predictor;
  const std::size_t dims = predictor.inputs();
  const auto outputs = static_cast<std::size_t>(predictor.outputs());  // the pose and the root
  predictor.mean({pose.input.data(), dims}, {pose.available.data(), dims}, {delta.data(), outputs},
                 shares_to_ask());
  const float open = tracker_.open();
  if (open < 1.0F) {
    const float rest = (1.0F - open) * static_cast<float>(options_.gate_fallback);
    Dims constant;
    predictor.constant(weights_.shares(), {constant.data(), outputs});
    for (std::size_t d = 0; d < outputs; ++d) delta[d] = open * delta[d] + rest * constant[d];
  }
  const bool limited = model_->limit_rad.size() > 0;
  for (std::size_t d = 0; d < dims; ++d) {
    if (limited) delta[d] = std::clamp(delta[d], -limit_rad_[d], limit_rad_[d]);
    delta[d] *= static_cast<float>(alpha_);
    shares[d] = mask_.factor(model_->parts[d]);
    shares[d] *= tracker_.trust(model_->loose_parts[d]);
  }
  if (model_->has_root) limit_root(&delta[dims]);
}

// The legs carry the pelvis: where the mask holds them, it stays.
RT_SAFE void StyleFilter::limit_root(const float* change) noexcept {
  const float legs = std::min(mask_.factor(BodyPart::kLeftLeg), mask_.factor(BodyPart::kRightLeg));
  for (Eigen::Index i = 0; i < root_.size(); ++i) {
    root_[i] =
        static_cast<float>(alpha_) * legs * std::clamp(change[i], -limit_root_[i], limit_root_[i]);
  }
}

// From lengths of a leg, and such lengths a stride, to metres and seconds.
RT_SAFE void StyleFilter::change_root() noexcept {
  const Root root = root_ + static_cast<float>(blend_weight_) * root_from_;
  last_root_ = root;
  const auto leg_m = static_cast<float>(model_->leg_m);
  const auto strides_s =
      static_cast<float>(tracker_.cadence_rad_s(*model_) / (2.0 * std::numbers::pi));
  const auto sine = static_cast<float>(std::sin(heading_.value_rad()));
  const auto cosine = static_cast<float>(std::cos(heading_.value_rad()));
  const float forward_m_s = leg_m * strides_s * root[1];
  const float left_m_s = leg_m * strides_s * root[2];
  root_change_ = {.height_m = leg_m * root[0],
                  .velocity_m_s = {forward_m_s * sine + left_m_s * cosine, 0.0F,
                                   forward_m_s * cosine - left_m_s * sine}};
}

// Per joint c = log(D_new^T D_old), so that R_styled exp(c) is what the old model delta would have
// given for this frame.
RT_SAFE void StyleFilter::begin_blend(const Rotations& in, const Frame& styled,
                                      double dt_s) noexcept {
  const int joints = std::min<int>(last_joints_, styled.joint_count);
  blend_weight_ = joints > 0 ? std::max(0.0, 1.0 - options_.alpha_slew_per_s * dt_s) : 0.0;
  blend_from_.fill({});
  root_from_ = joints > 0 ? Root(last_root_ - root_) : Root::Zero();
  for (std::size_t j = 0; j < static_cast<std::size_t>(joints); ++j) {
    const Quaterniond new_delta =
        to_eigen_double(in[j]).conjugate() * to_eigen_double(styled.rotation_xyzw[j]);
    const Quaterniond old_delta =
        to_eigen_double(last_in_[j]).conjugate() * to_eigen_double(last_out_[j]);
    const Vector3d c = rotation_log(Quaterniond(new_delta.conjugate() * old_delta));
    if (c.norm() < kNoTurn_rad) continue;
    for (int i = 0; i < 3; ++i) blend_from_[j][i] = static_cast<float>(c[i]);
  }
}

RT_SAFE void StyleFilter::blend(const Skeleton& skeleton, Frame& styled) const noexcept {
  if (blend_weight_ <= 0.0) return;
  for (std::size_t j = 0; j < styled.joint_count; ++j) {
    const Vec3f& c = blend_from_[j];
    if (!styled.valid[j] || (c[0] == 0.0F && c[1] == 0.0F && c[2] == 0.0F)) continue;
    const Vector3d turn = blend_weight_ * Vector3d(c[0], c[1], c[2]);
    const Quaterniond rotation = to_eigen_double(styled.rotation_xyzw[j]) * rotation_exp(turn);
    set_rotation(skeleton, static_cast<int>(j), rotation, styled);
  }
}

}  // namespace posed::style
