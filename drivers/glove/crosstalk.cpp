#include "drivers/glove/crosstalk.hpp"

#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>
#include <utility>

#include <Eigen/Cholesky>

#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

constexpr std::size_t kMinFrames = 60;  // of a move
// The prior: shares are about this large. What they do not explain, the user's own deviation from
// the fist or the move, is about this large, and so many independent values come of one move.
constexpr double kShare = 0.3;
constexpr double kUnexplained_rad = 3.0 * kDegree;
constexpr double kIndependent = 20.0;
constexpr double kPrior = (kUnexplained_rad / kShare) * (kUnexplained_rad / kShare);
constexpr double kMaxLeft = 0.9;  // most of a sensor's movement that the shares may leave
constexpr double kMoves_rad = 1.0 * kDegree;  // standard deviation of what is worth a share

enum class Does { kNeither, kBend, kSpread };
struct Role {
  Does does = Does::kNeither;
  std::size_t finger = 0;
};

// What the sensors measure: the bend of a finger's first joint, or its spread. The joints after it
// bend with it in the moves and cannot be told from it.
std::vector<Role> roles_of(const Calibration& calibration) {
  std::vector<Role> roles(calibration.sensors);
  for (const MapRow& row : std::span(calibration.map).first(calibration.map_rows)) {
    const std::size_t finger = row.channel / kFingerChannels;
    const std::size_t joint = row.channel % kFingerChannels / 3;
    const std::size_t axis = row.channel % 3;
    if (finger == 0 || roles[row.sensor].does != Does::kNeither) continue;
    if (axis == 0 && joint == 0) roles[row.sensor] = {Does::kBend, finger};
    if (axis == 1 && joint == 0) roles[row.sensor] = {Does::kSpread, finger};
  }
  return roles;
}

// The sensors whose movement sensor `s` may show: the bends of its finger and of those beside it if
// it measures a spread, else their spreads.
std::vector<std::size_t> beside(std::span<const Role> roles, std::size_t s) {
  std::vector<std::size_t> sensors;
  const Does source = roles[s].does == Does::kSpread ? Does::kBend : Does::kSpread;
  for (std::size_t other = 0; other < roles.size(); ++other) {
    const auto apart = static_cast<int>(roles[other].finger) - static_cast<int>(roles[s].finger);
    if (roles[other].does == source && std::abs(apart) <= 1) sensors.push_back(other);
  }
  return sensors;
}

// Calibrated values [frame][sensor] without their mean; frames that lack one of the sensors are
// left out.
Eigen::MatrixXd values_in(const Move& move, const Calibration& calibration,
                          std::span<const std::size_t> sensors) {
  Eigen::MatrixXd values(static_cast<Eigen::Index>(move.size()), std::ssize(sensors));
  Eigen::Index rows = 0;
  for (const auto& raw : move) {
    bool whole = true;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const float value = calibration.curve[sensors[i]].value_at(raw[sensors[i]]);
      whole = whole && std::isfinite(value);
      values(rows, static_cast<Eigen::Index>(i)) = static_cast<double>(value);
    }
    if (whole) ++rows;
  }
  values.conservativeResize(rows, Eigen::NoChange);
  return values;
}

Eigen::MatrixXd centred(const Eigen::MatrixXd& values) {
  return values.rowwise() - values.colwise().mean();
}

// Of the first column, the shares of the others.
Eigen::VectorXd ridge(const Eigen::MatrixXd& values) {
  const Eigen::MatrixXd moved = centred(values);
  const Eigen::MatrixXd others = moved.rightCols(moved.cols() - 1);
  const double prior = kPrior * static_cast<double>(moved.rows()) / kIndependent;
  Eigen::MatrixXd normal = others.transpose() * others;
  normal.diagonal().array() += prior;
  return normal.ldlt().solve(others.transpose() * moved.col(0));
}

// Standard deviation of what the shares leave of the first column.
double left_by(const Eigen::MatrixXd& values, const Eigen::VectorXd& shares) {
  const Eigen::MatrixXd moved = centred(values);
  const Eigen::VectorXd left = moved.col(0) - moved.rightCols(shares.size()) * shares;
  return std::sqrt(left.squaredNorm() / static_cast<double>(left.size()));
}

struct Found {
  Eigen::VectorXd shares;
  double before_rad = 0.0, left_rad = 0.0;
};

// Shares that one half of the move yields have to explain the other, each way round.
std::optional<Found> shares_in(const Eigen::MatrixXd& values) {
  const Eigen::Index half = values.rows() / 2;
  if (values.rows() < static_cast<Eigen::Index>(kMinFrames)) return std::nullopt;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(values.cols() - 1);
  const Eigen::MatrixXd first = values.topRows(half);
  const Eigen::MatrixXd second = values.bottomRows(half);
  const double before_rad = left_by(values, none);
  if (before_rad < kMoves_rad) return std::nullopt;
  if (left_by(second, ridge(first)) > kMaxLeft * left_by(second, none) ||
      left_by(first, ridge(second)) > kMaxLeft * left_by(first, none)) {
    return std::nullopt;
  }
  const Eigen::VectorXd shares = ridge(values);
  return Found{shares, before_rad, left_by(values, shares)};
}

// What sensor `s` shows of the others; its value of the flat hand stays as it is.
void set_shares(const Model& model, std::span<const double> flat, std::size_t s,
                std::span<const std::size_t> others, const Eigen::VectorXd& shares,
                CalibrationFile& file) {
  const std::string& name = model.sensors[s].name;
  double at_zero = 0.0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    double& share = file.crosstalk[name][model.sensors[others[i]].name];
    const double before = std::exchange(share, shares[static_cast<Eigen::Index>(i)]);
    if (std::isfinite(flat[others[i]])) at_zero += (share - before) * flat[others[i]];
  }
  for (auto& point : file.sensors[name]) point[1] += at_zero;
}

std::string rounded_deg(double rad) { return std::to_string(std::lround(rad / kDegree)); }

}  // namespace

Result<std::vector<std::string>> fit_fist(const Model& model, const Recorded& recorded, Side hand,
                                          CalibrationFile& file) {
  const auto& held = recorded[static_cast<std::size_t>(Pose::kFist)];
  const auto calibration = TRY(make_calibration(model, file, hand, /*identity=*/""));
  const std::vector<Role> roles = roles_of(*calibration);
  const auto flat = TRY(values_of(model, hand_in(Pose::kFlat)));
  const auto fist = TRY(values_of(model, hand_in(Pose::kFist)));
  const auto fitted = [&](std::size_t s) {
    return held[s].count > 0 && file.sensors.contains(model.sensors[s].name);
  };
  std::vector<std::string> sentences;
  for (std::size_t s = 0; s < roles.size(); ++s) {
    if (roles[s].does != Does::kSpread || !fitted(s)) continue;
    std::vector<std::size_t> bends = beside(roles, s);
    std::erase_if(bends, [&](std::size_t b) { return !fitted(b); });
    if (bends.empty()) continue;
    Eigen::VectorXd bent(std::ssize(bends));
    for (Eigen::Index i = 0; i < bent.size(); ++i) {
      const std::size_t b = bends[static_cast<std::size_t>(i)];
      bent[i] = fist[b] - flat[b];
    }
    const auto raw = static_cast<float>(held[s].mean());
    const double shown = static_cast<double>(calibration->curve[s].value_at(raw)) - fist[s];
    if (!(std::abs(shown) > kUnexplained_rad)) continue;
    // The ridge of one row: the smallest shares that explain what the fist shows.
    set_shares(model, flat, s, bends, bent * (shown / (kPrior + bent.squaredNorm())), file);
    sentences.push_back(model.sensors[s].name + " showed " + rounded_deg(shown) +
                        " degrees of spread in the fist, which are taken for its bent fingers'");
  }
  return sentences;
}

Result<std::vector<std::string>> fit_crosstalk(const Model& model, const Moves& moves, Side hand,
                                               CalibrationFile& file) {
  const auto calibration = TRY(make_calibration(model, file, hand, /*identity=*/""));
  const std::vector<Role> roles = roles_of(*calibration);
  const auto flat = TRY(values_of(model, hand_in(Pose::kFlat)));
  std::vector<std::string> sentences;
  for (std::size_t s = 0; s < roles.size(); ++s) {
    if (roles[s].does == Does::kNeither || !file.sensors.contains(model.sensors[s].name)) continue;
    const bool spreads = roles[s].does == Does::kSpread;
    std::vector<std::size_t> sensors = beside(roles, s);
    if (sensors.empty()) continue;
    sensors.insert(sensors.begin(), s);
    const auto found =
        shares_in(values_in(spreads ? moves.bend : moves.spread, *calibration, sensors));
    if (!found) continue;
    set_shares(model, flat, s, std::span(sensors).subspan(1), found->shares, file);
    sentences.push_back(model.sensors[s].name + " moved by " + rounded_deg(found->before_rad) +
                        " degrees with the fingers that " + (spreads ? "bent" : "spread") + "; " +
                        rounded_deg(found->left_rad) + " are left");
  }
  return sentences;
}

}  // namespace posed::drivers::glove
