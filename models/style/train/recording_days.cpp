#include "models/style/train/recording_days.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "models/style/train/harmonics.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;

// Widths of the likeness of two clips, in median distances between clips.
constexpr std::array kWidths{0.35, 0.5, 0.7};
// Following days must lower the squared error on held-out clips at least to this share of the
// error of one mean, because few clips always show some chance pattern.
constexpr double kWorth = 0.93;
constexpr std::size_t kMinClips = 3;  // with fewer, a held-out clip has one other to ask

using Key = std::tuple<std::string, std::string, std::string>;  // motion, group, person

std::map<Key, std::vector<int>> clips_by_person(const Dataset& dataset,
                                                const std::vector<ClipCycle>& cycles,
                                                const std::vector<int>& left_out) {
  std::map<Key, std::vector<int>> found;
  for (int i = 0; i < std::ssize(cycles); ++i) {
    if (std::ranges::find(left_out, i) != left_out.end()) continue;
    const std::size_t c = cycles[i].clip;
    const AlignedClip& clip = dataset.clips[c];
    const auto& person = dataset.subjects[clip.subject].name;
    found[{clip.motion, clip.group, person}].push_back(i);
  }
  return found;
}

// Row i: how much of each target clip lies at the place of source clip i in the two lists, as a
// share. With equal numbers the first belongs to the first, the last to the last.
MatrixXd same_places(Eigen::Index sources, Eigen::Index targets) {
  MatrixXd shares(sources, targets);
  const auto n = static_cast<double>(sources);
  const auto m = static_cast<double>(targets);
  for (Eigen::Index i = 0; i < sources; ++i) {
    for (Eigen::Index j = 0; j < targets; ++j) {
      const auto a = static_cast<double>(i);
      const auto b = static_cast<double>(j);
      const double overlap = std::min((a + 1) / n, (b + 1) / m) - std::max(a / n, b / m);
      shares(i, j) = n * std::max(0.0, overlap);
    }
  }
  return shares;
}

// One row a clip: its cycle on the grid.
MatrixXd stacked_cycles(const std::vector<ClipCycle>& cycles, const std::vector<int>& members) {
  const MatrixXd grid = grid_basis();
  const auto dims = cycles.front().coefficients.cols();
  MatrixXd rows(std::ssize(members), kGridFrames * dims);
  for (Eigen::Index i = 0; i < std::ssize(members); ++i) {
    const std::size_t at = members[i];
    rows.row(i) = (grid * cycles[at].coefficients).reshaped().transpose();
  }
  return rows;
}

MatrixXd distances_between(const MatrixXd& rows) {
  MatrixXd distances(rows.rows(), rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    distances.col(i) = (rows.rowwise() - rows.row(i)).rowwise().norm();
  }
  return distances;
}

double median_distance(const MatrixXd& distances) {
  std::vector<double> values;
  for (Eigen::Index i = 0; i < distances.rows(); ++i) {
    for (Eigen::Index k = 0; k < i; ++k) values.push_back(distances(i, k));
  }
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

// 1 where source clip k may predict the partner of source clip i: not itself, and no other that
// lies beside the same target clip, whose partner is the answer or a part of it.
MatrixXd may_predict(const MatrixXd& places) {
  constexpr double kRounding = 1e-9;
  return ((places * places.transpose()).array() < kRounding).cast<double>();
}

// Squared error of each clip's partner, predicted by these weights from the other clips'.
// Clips without a partner are skipped.
double left_out_error(const MatrixXd& weights, const MatrixXd& partners) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < weights.rows(); ++i) {
    const double all = weights.row(i).sum();
    if (all > 0.0) sum += (weights.row(i) * partners / all - partners.row(i)).squaredNorm();
  }
  return sum;
}

// How much clips k count for clip i, rows of sum 1; empty where one mean does as well.
MatrixXd day_weights(const MatrixXd& sources, const MatrixXd& targets, const MatrixXd& places) {
  const MatrixXd partners = places * targets;
  const MatrixXd others = may_predict(places);
  const MatrixXd distances = distances_between(sources);
  const double median = median_distance(distances);
  double best = kWorth * left_out_error(others, partners);
  MatrixXd chosen;
  for (const double width : kWidths) {
    const double scale = 1.0 / std::max(width * median, 1e-12);
    // The floor asks all clips where none is alike.
    const MatrixXd likeness = (-0.5 * (scale * distances).array().square()).exp() + 1e-6;
    const double error = left_out_error(likeness.cwiseProduct(others), partners);
    if (!(error < best)) continue;
    best = error;
    chosen = likeness.rowwise().sum().cwiseInverse().asDiagonal() * likeness;
  }
  return chosen;
}

MatrixXd mean_of(const std::vector<ClipCycle>& cycles, const std::vector<int>& members,
                 const Eigen::RowVectorXd& weights) {
  MatrixXd sum =
      MatrixXd::Zero(cycles.front().coefficients.rows(), cycles.front().coefficients.cols());
  for (Eigen::Index i = 0; i < std::ssize(members); ++i) {
    const std::size_t at = members[i];
    sum += weights[i] * cycles[at].coefficients;
  }
  return sum;
}

}  // namespace

std::vector<std::pair<int, MatrixXd>> day_changes(const Dataset& dataset,
                                                  const std::vector<ClipCycle>& cycles,
                                                  const std::vector<int>& left_out,
                                                  const std::string& target) {
  std::vector<std::pair<int, MatrixXd>> changes;
  const auto people = clips_by_person(dataset, cycles, left_out);
  for (const auto& [key, sources] : people) {
    const auto& [motion, group, person] = key;
    if (group == target || sources.size() < kMinClips) continue;
    const auto goals = people.find({motion, target, person});
    if (goals == people.end() || goals->second.size() < kMinClips) continue;
    const std::vector<int>& targets = goals->second;
    const MatrixXd places = same_places(std::ssize(sources), std::ssize(targets));
    const MatrixXd weights =
        day_weights(stacked_cycles(cycles, sources), stacked_cycles(cycles, targets), places);
    if (weights.size() == 0) continue;
    const auto even = 1.0 / static_cast<double>(sources.size());
    const Eigen::RowVectorXd all = Eigen::RowVectorXd::Constant(std::ssize(sources), even);
    const MatrixXd mean = mean_of(cycles, targets, all * places) - mean_of(cycles, sources, all);
    for (Eigen::Index i = 0; i < std::ssize(sources); ++i) {
      const Eigen::RowVectorXd alike = weights.row(i);
      changes.emplace_back(sources[i], mean_of(cycles, targets, alike * places) -
                                           mean_of(cycles, sources, alike) - mean);
    }
  }
  return changes;
}

}  // namespace posed::style
