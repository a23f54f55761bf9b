#include "models/style/judge/walker_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/gp/regression.hpp"
#include "models/motion/heading.hpp"
#include "models/motion/motion.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/median.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;

constexpr Eigen::Index kEnoughFrames = 600;  // at most, spread evenly over a long clip

MatrixXd evenly_taken(const MatrixXd& rows) {
  const Eigen::Index step = std::max<Eigen::Index>(1, rows.rows() / kEnoughFrames);
  return rows(Eigen::seq(0, rows.rows() - 1, step), Eigen::all);
}

// q of every frame [frames x dims] as the live filter sees it: a walker may turn.
MatrixXd live_vectors(const motion::Motion& motion, const motion::PoseSpace& space) {
  motion::LiveHeading heading;
  MatrixXd q(motion.size(), space.dims());
  std::vector<float> row(static_cast<std::size_t>(space.dims()));
  std::vector<std::uint8_t> available(row.size());
  for (int t = 0; t < motion.size(); ++t) {
    const Frame& frame = motion.frames[t];
    if (space.has_heading(frame)) heading.update(space.heading_rad(frame), 1.0 / motion.rate_hz);
    space.to_vector(frame, heading.value_rad(), row, available);
    q.row(t) = Eigen::Map<const Eigen::RowVectorXf>(row.data(), q.cols()).cast<double>();
  }
  return q;
}

}  // namespace

Result<WalkerFit> fit_of_walker(const StyleModel& model, const std::string& model_name,
                                const clip::Clip& clip) {
  auto motion = TRY(motion::performed_motion_of(clip));
  const auto space = motion::PoseSpace::bind_person(model.space, *motion.skeleton);
  if (!space) {
    Error error = space.error();
    if (error.file.empty()) error.file = model_name;
    return std::unexpected(std::move(error));
  }
  const MatrixXd q = evenly_taken(live_vectors(motion, *space));
  if (q.cols() != model.process.inputs.cols()) {
    return fail("the model's parts do not fit each other", model_name);
  }
  std::vector<double> squares;
  squares.reserve(static_cast<std::size_t>(q.rows()));
  for (Eigen::Index t = 0; t < q.rows(); ++t) {
    squares.push_back(
        (model.process.inputs.rowwise() - q.row(t)).rowwise().squaredNorm().minCoeff());
  }
  const auto joints = static_cast<double>(model.space.joints.size());
  WalkerFit fit;
  fit.distance_deg = std::sqrt(median(squares) / joints) / kDegree;
  fit.mean_change = gp::posterior_mean(model.process, q).colwise().mean();
  return fit;
}

StyleModel with_constant_change(StyleModel model, const Eigen::VectorXd& change) {
  model.process.weights.setZero();
  model.process.offset = change;
  return model;
}

}  // namespace posed::style
