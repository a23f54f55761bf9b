#include "models/style/bound_model.hpp"

namespace posed::style {
namespace {

Result<> check_fit(const StyleModel& model, int dims, const std::string& name) {
  const bool process_fits =
      model.process.inputs.cols() == dims && model.process.weights.cols() == dims;
  const auto fits = [dims](const Eigen::VectorXd& v) {
    return v.size() == 0 || (v.size() == dims && v.allFinite());
  };
  const bool spread =
      (model.limit_rad.array() >= 0.0).all() && (model.input_sd.array() >= 0.0).all();
  if (process_fits && spread && fits(model.limit_rad) && fits(model.input_mean) &&
      fits(model.input_sd) && fits(model.gate.neutral) && fits(model.axis.direction)) {
    return {};
  }
  return fail("the model's process, limits, input range, neutral pose and axis do not fit the " +
                  std::to_string(dims) + " dimensions of its pose space: train it again",
              name);
}

}  // namespace

BoundModel::BoundModel(const StyleModel& model, motion::PoseSpace bound_space,
                       gp::Predictor bound_predictor, std::string file)
    : StageModel(std::move(file)),
      space(std::move(bound_space)),
      predictor(std::move(bound_predictor)),
      limit_rad(model.limit_rad.cast<float>()),
      neutral(model.gate.neutral.cast<float>()),
      axis(model.axis.direction.cast<float>()),
      axis_offset(model.axis.offset) {
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
  if (auto fits = check_fit(model, space->dims(), name); !fits) {
    return std::unexpected(fits.error());
  }
  auto predictor = gp::Predictor::build(model.process, false);
  if (!predictor) {
    Error error = predictor.error();
    error.file = name;
    return std::unexpected(std::move(error));
  }
  return std::make_unique<const BoundModel>(model, std::move(*space), std::move(*predictor),
                                            std::move(name));
}

}  // namespace posed::style
