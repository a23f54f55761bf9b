#include "models/style/style_filter.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMaxStep_s = 0.1;
constexpr double kGateTau_s = 0.2;
constexpr double kCalibrationTau_s = 10.0;
constexpr float kCalibrationMax_rad = static_cast<float>(20.0 * kDegree);
constexpr double kNoTurn_rad = 1e-6;  // too small for single precision
constexpr float kInputSpread = 3.0F;  // standard deviations of the training inputs

double smoothing(double dt_s, double tau_s) { return -std::expm1(-dt_s / tau_s); }

bool usable(const Quatf& q) noexcept {
  const float norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return norm2 > 1e-6F && norm2 < 1e6F;  // false when not finite
}

// A joint whose quaternion is not a rotation counts as not measured, whatever its flag says.
// RT-safe.
void drop_broken_joints(Frame& frame) noexcept {
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    if (usable(frame.rotation_xyzw[j])) continue;
    frame.valid[j] = false;
    frame.rotation_xyzw[j] = kIdentity;
  }
}

Result<> check_fit(const StyleModel& model, int dims, const std::string& name) {
  const bool more_fit = std::ranges::all_of(model.more, [&](const MoreStyle& style) {
    return style.function.weights.cols() == dims && style.limit_rad.size() == dims &&
           (style.limit_rad.array() >= 0.0).all() && model.limit_rad.size() == dims;
  });
  const bool process_fits =
      more_fit && model.process.inputs.cols() == dims && model.process.weights.cols() == dims;
  const auto fits = [dims](const Eigen::VectorXd& v) {
    return v.size() == 0 || (v.size() == dims && v.allFinite());
  };
  const bool spread =
      (model.limit_rad.array() >= 0.0).all() && (model.input_sd.array() >= 0.0).all();
  if (process_fits && spread && fits(model.limit_rad) && fits(model.input_mean) &&
      fits(model.input_sd)) {
    return {};
  }
  return fail("the model's process, limits and input range do not fit the " + std::to_string(dims) +
                  " dimensions of its pose space: train it again",
              name);
}

}  // namespace

BoundModel::BoundModel(const StyleModel& model, motion::PoseSpace bound_space,
                       gp::Predictor bound_predictor, std::string file)
    : StageModel(std::move(file)),
      space(std::move(bound_space)),
      predictor(std::move(bound_predictor)),
      limit_rad(model.limit_rad.cast<float>()),
      input_mean(model.input_mean.cast<float>()),
      input_sd(model.input_sd.cast<float>()),
      styles(model.names()),
      parts(parts_of(space)) {
  for (const MoreStyle& style : model.more) {
    more_limits_rad.emplace_back(style.limit_rad.cast<float>());
  }
}

Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                     const Skeleton& skeleton,
                                                     const FilterOptions& options,
                                                     std::string name) {
  auto space = motion::PoseSpace::bind(model.space, skeleton);
  if (!space) {
    Error error = space.error();
    if (error.file.empty()) error.file = name;
    return std::unexpected(std::move(error));
  }
  if (auto fits = check_fit(model, space->dims(), name); !fits) {
    return std::unexpected(fits.error());
  }
  std::vector<gp::Function> more;
  for (const MoreStyle& style : model.more) more.push_back(style.function);
  auto predictor = gp::Predictor::build(model.process, options.gate, more);
  if (!predictor) {
    Error error = predictor.error();
    error.file = name;
    return std::unexpected(std::move(error));
  }
  return std::make_unique<const BoundModel>(model, std::move(*space), std::move(*predictor),
                                            std::move(name));
}

StyleFilter::StyleFilter(const BoundModel* model, const FilterOptions& options) noexcept
    : model_(model), options_(options) {
  options_.alpha_slew_per_s = std::clamp(options.alpha_slew_per_s, 1e-3, 1e6);
  set_alpha(static_cast<float>(options.alpha));
  mask_.begin(options.mask);
  if (model == nullptr) return;
  weights_.begin(
      shares_of(options.weights, model->styles).value_or(first_alone(model->styles.size())));
  for (int i = 0; i < gp::Predictor::kSettleCalls; ++i) {
    static_cast<void>(model->predictor.settle(weights_.shares()));
  }
  mix_limits();
}

// RT-safe
void StyleFilter::set_alpha(float alpha) noexcept {
  if (!std::isfinite(alpha)) return;
  alpha_target_ = std::clamp(static_cast<double>(alpha), -kMaxAlpha, kMaxAlpha);
}

// RT-safe
bool StyleFilter::set_shares(const Shares& shares) noexcept {
  if (model_ == nullptr || shares.count != model_->styles.size()) return false;
  weights_.aim(shares);
  return true;
}

// RT-safe
const BoundModel* StyleFilter::set_model(const BoundModel* model) noexcept {
  discontinuity_ = true;
  if (model_ == nullptr) {
    weights_.begin(first_alone(model->styles.size()));
  } else {
    weights_.rename(model_->styles, model->styles);
  }
  const BoundModel* const before = std::exchange(model_, model);
  mix_limits();
  return before;
}

// RT-safe
void StyleFilter::set(std::size_t parameter, double value) noexcept {
  switch (parameter) {
    case kAlpha:
      return set_alpha(static_cast<float>(value));
    case kAlphaSlew:
      options_.alpha_slew_per_s = value;
      return;
    case kGateFallback:
      discontinuity_ = discontinuity_ || value != options_.gate_fallback;
      options_.gate_fallback = value;
      return;
    case kCalibrate:
      discontinuity_ = discontinuity_ || (value != 0.0) != options_.calibrate;
      options_.calibrate = value != 0.0;
      return;
    default:
      return;  // a predictor is built with or without a gate
  }
}

// RT-safe
ParameterState StyleFilter::state(std::size_t parameter) const noexcept {
  const auto settled = [](double value) { return ParameterState{value, value}; };
  switch (parameter) {
    case kAlpha:
      return {alpha_, alpha_target_};
    case kAlphaSlew:
      return settled(options_.alpha_slew_per_s);
    case kGateFallback:
      return settled(options_.gate_fallback);
    case kCalibrate:
      return settled(options_.calibrate ? 1.0 : 0.0);
    default:
      return settled(options_.gate ? 1.0 : 0.0);
  }
}

// RT-safe
void StyleFilter::use(const StageModel& model) noexcept {
  static_cast<void>(set_model(static_cast<const BoundModel*>(&model)));
}

// RT-safe
bool StyleFilter::command(std::size_t index, const StageCommand& command) noexcept {
  if (index == kWeights) return set_shares(command.as<Shares>());
  if (index != kMask) return false;
  set_mask(command.as<Mask>());
  return true;
}

// RT-safe
void StyleFilter::describe(std::size_t index, const StageCommand& command,
                           ShortText& text) const noexcept {
  if (index == kMask) describe_mask(command.as<Mask>(), text);
  if (index == kWeights && model_ != nullptr) {
    describe_shares(command.as<Shares>(), model_->styles, text);
  }
}

float StyleFilter::alpha() const noexcept { return static_cast<float>(alpha_); }

void StyleFilter::settle(const Frame& frame, double heading_rad) noexcept {
  alpha_ = alpha_target_;
  const bool has_heading = model_ != nullptr && model_->space.has_heading(frame);
  heading_.settle(heading_rad, has_heading ? model_->space.heading_rad(frame) : heading_rad);
}

// RT-safe
void StyleFilter::process(const StageFrame& in, StageOut& out) noexcept {
  Frame frame = in.frame;
  drop_broken_joints(frame);
  const double dt_s = std::min(elapsed_.next_s(frame.header), kMaxStep_s);
  const double slew = options_.alpha_slew_per_s * dt_s;
  alpha_ += std::clamp(alpha_target_ - alpha_, -slew, slew);
  blend_weight_ = std::max(0.0, blend_weight_ - slew);
  mask_.move(slew);
  if (weights_.moving()) {
    weights_.move(slew);
    mix_limits();
  }
  const bool served = model_ != nullptr && frame.skeleton == model_->space.skeleton().id;
  if (served) {
    style(frame, dt_s);
  } else {
    last_joints_ = 0;  // the pose is that of another body, so there is nothing to blend from
  }
  out.frame({.frame = frame, .variance_rad2 = in.variance_rad2, .input = in.input});
}

// RT-safe
void StyleFilter::style(Frame& frame, double dt_s) noexcept {
  const motion::PoseSpace& space = model_->space;
  if (space.has_heading(frame) && heading_.update(space.heading_rad(frame), dt_s)) {
    discontinuity_ = true;
  }
  if (discontinuity_) {
    gate_ = -1.0F;
    offset_.fill(0.0F);
  }
  const Rotations in = frame.rotation_xyzw;
  if (alpha_ != 0.0) {
    Dims q;
    Dims delta;
    Flags available;
    const auto dims = static_cast<std::size_t>(space.dims());
    space.to_vector(frame, heading_.value_rad(), {q.data(), dims}, {available.data(), dims});
    answer(q, available, dt_s, delta);
    space.add(frame, heading_.value_rad(), {q.data(), dims}, {delta.data(), dims});
  }
  if (std::exchange(discontinuity_, false)) begin_blend(in, frame, dt_s);
  blend(frame);
  last_joints_ = frame.joint_count;
  last_in_ = in;
  last_out_ = frame.rotation_xyzw;
}

// Empty while the predictor has the mixture ready. RT-safe
std::span<const float> StyleFilter::shares_to_ask() noexcept {
  if (weights_.moving() || !model_->predictor.settle(weights_.shares())) return weights_.shares();
  return {};
}

// RT-safe
void StyleFilter::mix_limits() noexcept {
  const Eigen::VectorXf& first = model_->limit_rad;
  const std::span<const float> shares = weights_.shares();
  for (Eigen::Index d = 0; d < first.size(); ++d) {
    float limit = shares[0] * first[d];
    for (std::size_t s = 1; s < shares.size(); ++s) {
      limit += shares[s] * model_->more_limits_rad[s - 1][d];
    }
    limit_rad_[static_cast<std::size_t>(d)] = limit;
  }
}

// The model delta: alpha times the mixture of styles, gated, clamped and masked. RT-safe
void StyleFilter::answer(const Dims& q, const Flags& available, double dt_s, Dims& delta) noexcept {
  const gp::Predictor& predictor = model_->predictor;
  const auto dims = static_cast<std::size_t>(predictor.inputs());
  Dims clipped;
  const bool clips = options_.calibrate || options_.gate;
  if (clips) kernel_input(q, available, dt_s, clipped);
  const std::span<const float> input((clips ? clipped : q).data(), dims);
  const std::span<const std::uint8_t> flags(available.data(), dims);
  const std::span<float> out(delta.data(), dims);
  const std::span<const float> shares = shares_to_ask();
  if (options_.gate && predictor.has_confidence()) {
    const float g = smoothed_gate(predictor.mean_and_confidence(input, flags, out, shares), dt_s);
    const float rest = (1.0F - g) * static_cast<float>(options_.gate_fallback);
    Dims constant;
    predictor.constant(weights_.shares(), {constant.data(), dims});
    for (std::size_t d = 0; d < dims; ++d) out[d] = g * out[d] + rest * constant[d];
  } else {
    predictor.mean(input, flags, out, shares);
  }
  const bool limited = model_->limit_rad.size() > 0;
  for (std::size_t d = 0; d < dims; ++d) {
    if (limited) out[d] = std::clamp(out[d], -limit_rad_[d], limit_rad_[d]);
    out[d] *= static_cast<float>(alpha_) * mask_.factor(model_->parts[d]);
  }
}

// RT-safe
float StyleFilter::smoothed_gate(float confidence, double dt_s) noexcept {
  if (gate_ < 0.0F) gate_ = confidence;
  gate_ += static_cast<float>(smoothing(dt_s, kGateTau_s)) * (confidence - gate_);
  return gate_;
}

// The kernel's input: q without the walker's own mean offset where calibration is on, clipped to
// the range of the training poses (README.md, "Filter", Calibration). RT-safe
void StyleFilter::kernel_input(const Dims& q, const Flags& available, double dt_s,
                               Dims& input) noexcept {
  const Eigen::VectorXf& mean = model_->input_mean;
  const Eigen::VectorXf& sd = model_->input_sd;
  const auto dims = static_cast<std::size_t>(model_->predictor.inputs());
  const auto rate = static_cast<float>(smoothing(dt_s, kCalibrationTau_s));
  for (std::size_t d = 0; d < dims; ++d) {
    input[d] = q[d];
    if (mean.size() == 0) continue;
    if (options_.calibrate) {
      if (available[d] != 0) offset_[d] += rate * (q[d] - mean[d] - offset_[d]);
      input[d] -= std::clamp(offset_[d], -kCalibrationMax_rad, kCalibrationMax_rad);
    }
    if (sd.size() == 0) continue;
    const float reach = kInputSpread * sd[d];
    input[d] = std::clamp(input[d], mean[d] - reach, mean[d] + reach);
  }
}

// Per joint c = log(D_new^T D_old), so that R_styled exp(c) is what the old model delta would have
// given for this frame. RT-safe
void StyleFilter::begin_blend(const Rotations& in, const Frame& styled, double dt_s) noexcept {
  const int joints = std::min<int>(last_joints_, styled.joint_count);
  blend_weight_ = joints > 0 ? std::max(0.0, 1.0 - options_.alpha_slew_per_s * dt_s) : 0.0;
  blend_from_.fill({});
  for (std::size_t j = 0; j < static_cast<std::size_t>(joints); ++j) {
    const Quaterniond new_delta =
        to_eigen_double(in[j]).conjugate() * to_eigen_double(styled.rotation_xyzw[j]);
    const Quaterniond old_delta =
        to_eigen_double(last_in_[j]).conjugate() * to_eigen_double(last_out_[j]);
    const Vector3d c = rotation_log(Quaterniond(new_delta.conjugate() * old_delta));
    if (c.norm() < kNoTurn_rad) continue;
    for (int i = 0; i < 3; ++i)
      blend_from_[j][static_cast<std::size_t>(i)] = static_cast<float>(c[i]);
  }
}

// RT-safe
void StyleFilter::blend(Frame& styled) const noexcept {
  if (blend_weight_ <= 0.0) return;
  for (std::size_t j = 0; j < styled.joint_count; ++j) {
    const Vec3f& c = blend_from_[j];
    if (!styled.valid[j] || (c[0] == 0.0F && c[1] == 0.0F && c[2] == 0.0F)) continue;
    const Vector3d turn = blend_weight_ * Vector3d(c[0], c[1], c[2]);
    const Quaterniond rotation = to_eigen_double(styled.rotation_xyzw[j]) * rotation_exp(turn);
    set_rotation(model_->space.skeleton(), static_cast<int>(j), rotation, styled);
  }
}

}  // namespace posed::style
