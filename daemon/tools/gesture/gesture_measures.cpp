#include "daemon/tools/gesture/gesture_measures.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "daemon/tools/command/degrees.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/gesture/train.hpp"
#include "models/motion/naturalness.hpp"
#include "models/perform/constrain.hpp"
#include "models/perform/perform.hpp"

namespace posed::tools {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

motion::Rows degrees_of(const gesture::Recording& recording) {
  return kDegrees * recording.angles_rad;
}

// The distance of each frame to the nearest frame of `reference`: rms over all frames and the
// channels that move.
double nearest_deg(const motion::Rows& rows, const motion::Rows& reference) {
  const Eigen::RowVectorXd low = reference.colwise().minCoeff();
  const auto moving = ((reference.colwise().maxCoeff() - low).array() > 1.0).count();
  double squares = 0.0;
  for (Eigen::Index t = 0; t < rows.rows(); ++t) {
    squares += (reference.rowwise() - rows.row(t)).rowwise().squaredNorm().minCoeff();
  }
  return std::sqrt(squares / static_cast<double>(rows.rows() * std::max<Eigen::Index>(1, moving)));
}

// Poses that stand in for a held pose.
using Candidate = std::pair<const char*, std::vector<double>>;

// What the recorded poses [frame][channel] give for `wanted` without a model.
std::vector<Candidate> without_model(const gesture::Vocabulary& vocabulary,
                                     const gesture::FeatureMatrix& recorded,
                                     const std::vector<double>& wanted) {
  const gesture::FeatureMatrix off =
      recorded.rowwise() - Eigen::Map<const Eigen::RowVectorXd>(wanted.data(), recorded.cols());
  Eigen::Index at = 0;
  off.rowwise().squaredNorm().minCoeff(&at);
  std::vector<double> composed(wanted.size());
  for (const gesture::ChannelGroup& group : vocabulary.groups) {
    Eigen::Index best = 0;
    off.middleCols(group.first, group.channels).rowwise().squaredNorm().minCoeff(&best);
    const double* const from = recorded.row(best).data() + group.first;
    std::copy_n(from, group.channels, composed.begin() + group.first);
  }
  const Eigen::RowVectorXd mean = recorded.colwise().mean();
  return {{"nearest_recorded_deg", {recorded.row(at).begin(), recorded.row(at).end()}},
          {"constant_deg", {mean.begin(), mean.end()}},
          {"best_composition_deg", composed}};
}

// Adds each candidate's distance from `wanted`, in all and in each group.
json distances(const gesture::Vocabulary& vocabulary, const std::vector<Candidate>& candidates,
               const std::vector<double>& wanted) {
  json out{{"groups", json::object()}};
  for (const auto& [name, pose] : candidates) {
    out[name] = kDegrees * gesture::apart(vocabulary, pose, wanted).rms_rad();
    for (const gesture::ChannelGroup& group : vocabulary.groups) {
      out["groups"][group.name][name] =
          kDegrees * gesture::apart(vocabulary, group, pose, wanted).rms_rad();
    }
  }
  return out;
}

// The root mean square of a figure over all labels.
double over_labels(const json& labels, const char* name) {
  double squares = 0.0;
  for (const json& label : labels) squares += std::pow(label[name].get<double>(), 2);
  return std::sqrt(squares / static_cast<double>(labels.size()));
}

// The reference's segments whose labels the model has.
gesture::Recording known_part(const gesture::GestureModel& model,
                              const gesture::Recording& reference) {
  gesture::Recording known = reference;
  std::erase_if(known.segments, [&](const gesture::Segment& segment) {
    return model.label_index(segment.label) < 0;
  });
  return known;
}

}  // namespace

json smoothness(const gesture::Vocabulary& vocabulary, const gesture::Recording& motion) {
  const motion::Rows rows = degrees_of(motion);
  const Eigen::VectorXd speed = motion::speed_of(rows, motion.rate_hz);
  const std::span<const double> values(speed.data(), static_cast<std::size_t>(speed.size()));
  json jerk_of_groups;
  for (const gesture::ChannelGroup& group : vocabulary.groups) {
    jerk_of_groups[group.name] = motion::jerk_rms(rows.middleCols(group.first, group.channels));
  }
  return {{"frames", rows.rows()},
          {"jerk", motion::jerk_rms(rows)},
          {"ldlj", number(motion::log_dimensionless_jerk(values, motion.rate_hz))},
          {"sparc", number(motion::spectral_arc_length(values, motion.rate_hz))},
          {"jerk_of_groups", jerk_of_groups}};
}

Result<json> against(const gesture::Vocabulary& vocabulary, const gesture::Recording& performed,
                     const gesture::Recording& reference) {
  const motion::Rows rows = degrees_of(performed), recorded = degrees_of(reference);
  if (recorded.rows() < 4) return fail("the reference has fewer than four frames", reference.file);
  json report = smoothness(vocabulary, reference);
  report["nearest_reference_deg"] = nearest_deg(rows, recorded);
  if (const auto distance = motion::motion_distance(rows, recorded)) {
    report["frechet"] = *distance;
  } else {
    report["frechet"] = nullptr;
    report["frechet_missing"] = distance.error().text();
  }
  return report;
}

Result<json> hold_errors(const trajectory::StateInformation& information,
                         const gesture::Recording& reference,
                         const std::vector<gesture::Recording>& recorded) {
  const gesture::GestureModel& model = information.model();
  const gesture::Recording known = known_part(model, reference);
  if (known.segments.empty()) {
    return misuse("the model has none of the reference's labels; give labels that it has",
                  reference.file);
  }
  std::vector<int> labels;
  labels.reserve(known.segments.size());
  for (const gesture::Segment& segment : known.segments) {
    labels.push_back(model.label_index(segment.label));
  }
  auto performance = perform::perform(information, labels, {});
  if (model.is_hand()) perform::constrain(performance, default_hand_shape());
  const auto performed = gesture::label_poses({perform::recording_of(model, performance)});
  const auto wanted = gesture::label_poses({known});  // the same names in the same order
  const auto poses = recorded.empty() ? gesture::FeatureMatrix() : all_poses(recorded);
  json rows = json::array();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    std::vector<Candidate> candidates{{"deg", performed[i].angles_rad}};
    if (!recorded.empty()) {
      std::ranges::move(without_model(model, poses, wanted[i].angles_rad),
                        std::back_inserter(candidates));
    }
    json row = distances(model, candidates, wanted[i].angles_rad);
    const int label = model.label_index(wanted[i].name);
    row["label"] = wanted[i].name;
    row["recorded"] = model.labels[static_cast<std::size_t>(label)].trained;
    rows.push_back(std::move(row));
  }
  json out{{"deg", over_labels(rows, "deg")}};
  for (const char* name : {"nearest_recorded_deg", "constant_deg", "best_composition_deg"}) {
    if (!recorded.empty()) out[name] = over_labels(rows, name);
  }
  out["labels"] = std::move(rows);
  return out;
}

gesture::FeatureMatrix all_poses(const std::vector<gesture::Recording>& recordings) {
  Eigen::Index frames = 0;
  for (const gesture::Recording& recording : recordings) frames += recording.angles_rad.rows();
  gesture::FeatureMatrix poses(frames, recordings.front().angles_rad.cols());
  frames = 0;
  for (const gesture::Recording& recording : recordings) {
    poses.middleRows(frames, recording.angles_rad.rows()) = recording.angles_rad;
    frames += recording.angles_rad.rows();
  }
  return poses;
}

}  // namespace posed::tools
