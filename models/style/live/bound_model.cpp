#include "models/style/live/bound_model.hpp"

#include <algorithm>

namespace posed::style {
namespace {

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
  const bool limits_fit = fits(model.limit_rad) && (model.limit_rad.array() >= 0.0).all();
  if (process_fits && limits_fit && fits(model.gate.neutral) && fits(model.axis.direction)) {
    return {};
  }
  return fail("the model's process, limits, neutral pose and axis do not fit the " +
                  std::to_string(dims) + " dimensions of its pose space: train it again",
              name);
}

// What the user is told of the joints that the figure lacks.
std::string left_alone(const motion::PoseSpace& space) {
  if (space.missing().empty()) return {};
  std::string names;
  for (const std::string& name : space.missing()) names += (names.empty() ? "" : ", ") + name;
  return "the figure has no " + names + ", which the model was trained with; the rest is styled";
}

// The axis over the dimensions that are there, longer by what the others would have added.
Eigen::VectorXf served_axis(const Eigen::VectorXf& axis, const std::vector<std::uint8_t>& served) {
  Eigen::VectorXf there = axis;
  for (Eigen::Index d = 0; d < axis.size(); ++d) {
    if (served[static_cast<std::size_t>(d)] == 0) there[d] = 0.0F;
  }
  const float kept = there.squaredNorm();
  return kept > 0.0F ? Eigen::VectorXf(there * (axis.squaredNorm() / kept)) : there;
}

}  // namespace

BoundModel::BoundModel(const StyleModel& model, motion::PoseSpace bound_space,
                       gp::Predictor bound_predictor, std::string file)
    : StageModel(std::move(file), model.names()),
      space(std::move(bound_space)),
      predictor(std::move(bound_predictor)),
      limit_rad(model.limit_rad.cast<float>()),
      neutral(model.gate.neutral.cast<float>()),
      axis(model.axis.direction.cast<float>()),
      axis_offset(model.axis.offset),
      parts(parts_of(space, model.space)) {
  remark = left_alone(space);
  served.assign(static_cast<std::size_t>(space.dims()), 1);
  for (int d = 0; d < space.dims(); ++d) {
    served[static_cast<std::size_t>(d)] = space.skeleton_joint_of_dim(d) >= 0 ? 1 : 0;
  }
  if (axis.size() > 0) axis = served_axis(axis, served);
  for (const MoreStyle& style : model.more) {
    more_limits_rad.emplace_back(style.limit_rad.cast<float>());
  }
  if (model.gate.present()) known.emplace(model, space.skeleton());
}

Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                     const Skeleton& skeleton, std::string name) {
  auto space = motion::PoseSpace::bind_person(model.space, skeleton);
  if (!space) {
    Error error = space.error();
    if (error.file.empty()) error.file = name;
    return std::unexpected(std::move(error));
  }
  TRY(check_fit(model, space->dims(), name));
  std::vector<gp::Function> more;
  more.reserve(model.more.size());
  for (const MoreStyle& style : model.more) more.push_back(style.function);
  auto predictor = gp::Predictor::build(model.process, more);
  if (!predictor) {
    Error error = predictor.error();
    error.file = name;
    return std::unexpected(std::move(error));
  }
  return std::make_unique<const BoundModel>(model, std::move(*space), std::move(*predictor),
                                            std::move(name));
}

}  // namespace posed::style
