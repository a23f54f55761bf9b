#include "models/style/live/bound_model.hpp"

#include <algorithm>

#include "models/feet/legs.hpp"

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
  const bool usual_fit = std::ranges::all_of(model.gate.usual, [dims](const auto& cycle) {
    return cycle.rows() == kCycleRows && cycle.cols() == dims && cycle.allFinite();
  });
  const bool roots_fit = (model.roots.empty() || model.roots.size() == model.styles()) &&
                         std::ranges::all_of(model.roots, [&](const RootFunction& root) {
                           return root.function.weights.rows() == model.process.weights.rows() &&
                                  root.function.weights.cols() == RootFunction::kDims &&
                                  root.function.offset.size() == RootFunction::kDims;
                         });
  if (process_fits && limits_fit && usual_fit && roots_fit && fits(model.gate.neutral) &&
      fits(model.axis.direction)) {
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
      hinges(space.skeleton()),
      predictor(std::move(bound_predictor)),
      limit_rad(model.limit_rad.cast<float>()),
      neutral(model.gate.neutral.cast<float>()),
      axis(model.axis.direction.cast<float>()),
      axis_offset(model.axis.offset),
      parts(parts_of(space, model.space)),
      loose_parts(loose_parts_of(space, model.space)) {
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
  for (int d = 0; d < space.dims(); ++d) {
    if (loose_parts[static_cast<std::size_t>(d)] != LoosePart::kNone) continue;
    leg_dims.push_back(static_cast<std::uint16_t>(d));
  }
  for (const Eigen::MatrixXd& cycle : model.gate.usual) {
    Usual& one = usual.emplace_back();
    one.cycle = (grid_basis() * cycle).cast<float>();
    one.does.fit(leg_dims, one.cycle, one.cycle);
  }
  if (usual.empty()) return;
  Usual& all = anyone.emplace();
  all.cycle = usual.front().cycle;
  for (std::size_t u = 1; u < usual.size(); ++u) all.cycle += usual[u].cycle;
  all.cycle /= static_cast<float>(usual.size());
  all.does.fit(leg_dims, all.cycle, all.cycle);
}

namespace {

// The function of the pose with that of the root behind it.
gp::Function with_root(const Eigen::MatrixXd& weights, const Eigen::VectorXd& offset,
                       const RootFunction& root) {
  gp::Function both{Eigen::MatrixXd(weights.rows(), weights.cols() + RootFunction::kDims),
                    Eigen::VectorXd(offset.size() + RootFunction::kDims)};
  both.weights << weights, root.function.weights;
  both.offset << offset, root.function.offset;
  return both;
}

}  // namespace

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
  gp::Trained process = model.process;
  const auto legs = feet::Legs::find(skeleton);
  const bool has_root =
      legs && !model.roots.empty() && space->dims() + RootFunction::kDims <= motion::kMaxPoseDims;
  if (has_root) {
    gp::Function first = with_root(process.weights, process.offset, model.roots.front());
    process.weights = std::move(first.weights);
    process.offset = std::move(first.offset);
    for (std::size_t s = 0; s < more.size(); ++s) {
      more[s] = with_root(more[s].weights, more[s].offset, model.roots[s + 1]);
    }
  }
  auto predictor = gp::Predictor::build(process, more);
  if (!predictor) {
    Error error = predictor.error();
    error.file = name;
    return std::unexpected(std::move(error));
  }
  auto bound = std::make_unique<BoundModel>(model, std::move(*space), std::move(*predictor),
                                            std::move(name));
  bound->has_root = has_root;
  const auto& rigs = model.gate.rigs;
  const bool is_other = !rigs.empty() && std::ranges::find(rigs, rig_id(skeleton)) == rigs.end();
  if (is_other) bound->turns = BoneTurns::make(model.space, model.gate.places, skeleton);
  bound->reach = alpha_reach(*bound);
  if (!has_root) return bound;
  bound->leg_m = legs->length_m();
  for (const RootFunction& root : model.roots) {
    bound->root_limits.emplace_back(root.limit.cast<float>());
  }
  return bound;
}

}  // namespace posed::style
