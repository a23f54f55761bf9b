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
      parts(parts_of(space)) {
  for (const MoreStyle& style : model.more) {
    more_limits_rad.emplace_back(style.limit_rad.cast<float>());
  }
  if (model.gate.present()) known.emplace(model, space.skeleton());
}

Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                     const Skeleton& skeleton, std::string name) {
  auto space = motion::PoseSpace::bind(model.space, skeleton);
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
