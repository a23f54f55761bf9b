#include "models/gesture/held_poses.hpp"

#include <algorithm>
#include <map>
#include <string>

#include <Eigen/Cholesky>

#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSlack_rad = 4.0 * kDegree;  // in every angle, beside the spread over people
constexpr double kKept = 0.975;               // of the poses of people who are left out
// Takes of one person are more alike than people are: the limit is so many times as far.
constexpr double kWidened = 6.0;
constexpr double kMinLimit = 1e-3;  // of a limit, for each channel

// The mean of one gesture's held part.
struct HeldPose {
  std::size_t unit;   // left out together
  std::size_t label;  // among the recorded ones
  VectorXd angles_rad;
};

// Of one label's poses.
struct PoseSums {
  double count = 0.0;
  VectorXd first;
  MatrixXd second;

  explicit PoseSums(Index channels)
      : first(VectorXd::Zero(channels)), second(MatrixXd::Zero(channels, channels)) {}
  void add(const VectorXd& x, double weight) {
    count += weight;
    first += weight * x;
    second.noalias() += weight * x * x.transpose();
  }
  [[nodiscard]] VectorXd mean() const { return first / count; }
};

struct Whitening {
  std::vector<VectorXd> mean;  // [label]; empty: no pose of it
  Eigen::LLT<MatrixXd> spread;

  [[nodiscard]] double distance(std::size_t label, const VectorXd& x) const {
    return spread.matrixL().solve(x - mean[label]).squaredNorm();
  }
};

// The poses' spread about their label's mean, one for all labels.
Whitening whitening_of(const std::vector<PoseSums>& sums) {
  const Index channels = sums.front().first.size();
  MatrixXd scatter = MatrixXd::Zero(channels, channels);
  Whitening out;
  double freedom = 0.0;
  for (const PoseSums& of : sums) {
    out.mean.emplace_back();
    if (of.count < 0.5) continue;
    out.mean.back() = of.mean();
    scatter += of.second - of.count * out.mean.back() * out.mean.back().transpose();
    freedom += of.count - 1.0;
  }
  scatter /= std::max(freedom, 1.0);
  scatter.diagonal().array() += kSlack_rad * kSlack_rad;
  out.spread.compute(scatter);
  return out;
}

// People where several are named, else recordings, else each gesture by itself.
std::vector<HeldPose> poses_of(const std::vector<Recording>& recordings,
                               const std::map<std::string, std::size_t>& labels, int people) {
  std::map<std::string, std::size_t> persons;
  std::vector<HeldPose> poses;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    const std::size_t person = persons.try_emplace(recording.person, persons.size()).first->second;
    for (const Segment& segment : recording.segments) {
      const Segment held = held_part(segment);
      const std::size_t unit = people > 1 ? person : recordings.size() > 1 ? r : poses.size();
      poses.push_back(
          {unit, labels.at(segment.label),
           recording.angles_rad.middleRows(held.begin, held.frames()).colwise().mean()});
    }
  }
  return poses;
}

// [label][pose] distance of each pose from its label as learnt without the pose's unit.
std::vector<std::vector<double>> distances_left_out(const std::vector<HeldPose>& poses,
                                                    const std::vector<PoseSums>& all) {
  std::map<std::size_t, std::vector<const HeldPose*>> units;
  for (const HeldPose& pose : poses) units[pose.unit].push_back(&pose);
  std::vector<std::vector<double>> distances(all.size());
  for (const auto& [unit, left_out] : units) {
    std::vector<PoseSums> rest = all;
    for (const HeldPose* pose : left_out) rest[pose->label].add(pose->angles_rad, -1.0);
    const Whitening learnt = whitening_of(rest);
    for (const HeldPose* pose : left_out) {
      if (learnt.mean[pose->label].size() == 0) continue;  // nobody else shows it
      distances[pose->label].push_back(learnt.distance(pose->label, pose->angles_rad));
    }
  }
  return distances;
}

// Of few values the second largest, because one gesture that was labelled wrongly would make the
// largest any number.
double share_below(std::vector<double> values, double share) {
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(at));
  return values[at];
}

int people_in(const std::vector<Recording>& recordings) {
  std::map<std::string, int> people;
  for (const Recording& recording : recordings) ++people[recording.person];
  return static_cast<int>(people.size());
}

}  // namespace

HeldPoses held_poses(const std::vector<Recording>& recordings, const std::vector<Label>& labels) {
  std::map<std::string, std::size_t> recorded;
  for (const Label& label : labels) {
    if (label.trained) recorded.emplace(label.name, recorded.size());
  }
  HeldPoses held{.mean = {}, .whitening = {}, .limit = {}, .people = people_in(recordings)};
  const auto poses = poses_of(recordings, recorded, held.people);
  const Index channels = recordings.front().angles_rad.cols();
  std::vector<PoseSums> sums(recorded.size(), PoseSums(channels));
  for (const HeldPose& pose : poses) sums[pose.label].add(pose.angles_rad, 1.0);
  const Whitening learnt = whitening_of(sums);
  const MatrixXd inverse = learnt.spread.matrixL().solve(MatrixXd::Identity(channels, channels));
  for (Index row = 0; row < channels; ++row) {
    for (Index c = 0; c <= row; ++c) held.whitening.push_back(inverse(row, c));
  }
  for (const VectorXd& mean : learnt.mean) held.mean.emplace_back(mean.begin(), mean.end());
  const auto distances = distances_left_out(poses, sums);
  std::vector<double> all;  // for a label that only one person shows
  for (const auto& of : distances) all.insert(all.end(), of.begin(), of.end());
  const double widened = held.people > 1 ? 1.0 : kWidened;
  for (const auto& of : distances) {
    const auto& shown = of.empty() ? all : of;
    // As many squared unit deviations as there are channels, where nothing was left out.
    const double limit = shown.empty() ? static_cast<double>(channels) : share_below(shown, kKept);
    // Poses that are the same to the bit have no spread to learn from.
    held.limit.push_back(widened * std::max(limit, kMinLimit * static_cast<double>(channels)));
  }
  return held;
}

}  // namespace posed::gesture
