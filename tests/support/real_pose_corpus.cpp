#include "tests/support/real_pose_corpus.hpp"

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "models/random.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/hand.hpp"
#include "proto/text/load_file.hpp"

namespace posed::test {
namespace {

using Eigen::RowVectorXd;
using gesture::FeatureMatrix;

constexpr double kRate_hz = 30.0;
constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kSensors = 22;
enum Axis { kFlexion, kSpread, kTwist };

int channel(int finger, int joint, Axis axis) {
  return finger * kFingerChannels + 3 * (joint - 1) + axis;
}

// Maps 22 sensor angles, in the order of the glove's protocol sheet 1.4, to the joints that they
// measure.
RowVectorXd hand_of(const std::vector<double>& sensor) {
  RowVectorXd hand = RowVectorXd::Zero(kHandChannels);
  hand[channel(0, 1, kTwist)] = sensor[0];
  hand[channel(0, 2, kFlexion)] = sensor[1];
  hand[channel(0, 3, kFlexion)] = sensor[2];
  hand[channel(0, 1, kSpread)] = sensor[3];
  const int first_sensor[]{0, 4, 7, 11, 15};
  for (int finger = 1; finger < kFingers; ++finger) {
    for (int joint = 1; joint <= kFingerJoints; ++joint) {
      hand[channel(finger, joint, kFlexion)] = sensor[first_sensor[finger] + joint - 1];
    }
  }
  hand[channel(1, 1, kSpread)] = sensor[10];
  hand[channel(3, 1, kSpread)] = -sensor[14];
  hand[channel(4, 1, kSpread)] = -sensor[14] - sensor[18];
  return hand;
}

// The numbers at the start of a line; the sign's name follows them.
std::vector<double> numbers_of(std::string_view line) {
  std::vector<double> numbers;
  while (!line.empty()) {
    const auto number = clip::parse_number(line.substr(0, line.find(',')));
    if (!number) return numbers;
    numbers.push_back(*number);
    line.remove_prefix(std::min(line.size(), line.find(',')) + (line.contains(',') ? 1 : 0));
  }
  return numbers;
}

FeatureMatrix stacked(const std::vector<RowVectorXd>& rows) {
  FeatureMatrix out(static_cast<Eigen::Index>(rows.size()), kHandChannels);
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = rows[i];
  return out;
}

double minimum_jerk(double t) { return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t); }

}  // namespace

FeatureMatrix libras_poses(const std::filesystem::path& folder, const std::string& sign) {
  const std::string text =
      load_file(folder / (sign + ".csv"), {"recording", std::uintmax_t{1} << 30}).value();
  std::vector<RowVectorXd> rows;
  for (std::string_view left = text; !left.empty();) {
    std::vector<double> sensors = numbers_of(clip::next_line(left));
    if (sensors.size() < kSensors) continue;
    for (double& value : sensors) value = -value;  // flexion is positive in hand45
    rows.push_back(hand_of(sensors));
  }
  if (rows.empty()) throw std::runtime_error("no poses of " + sign);
  return stacked(rows);
}

gesture::Recording real_pose_corpus(const std::filesystem::path& folder, std::uint32_t seed,
                                    int gestures) {
  PortableRandom random(seed);
  const std::vector<std::string> labels{"g", "c", "p"};
  std::vector<FeatureMatrix> poses;
  for (const std::string& label : labels) poses.push_back(libras_poses(folder, kSignOf.at(label)));
  const auto pick = [&](const FeatureMatrix& of) {
    return RowVectorXd(of.row(random.below(static_cast<int>(of.rows()))));
  };
  gesture::Recording out{.file = "corpus", .rate_hz = kRate_hz, .angles_rad = {}, .segments = {}};
  std::vector<RowVectorXd> rows;
  int label = random.below(3);
  RowVectorXd pose = pick(poses[label]);
  for (int i = 0; i < gestures; ++i) {
    const RowVectorXd mean = poses[label].colwise().mean();
    const RowVectorXd target = mean + 0.5 * (pick(poses[label]) - mean);
    const int move = static_cast<int>(random.uniform(0.3, 0.6) * kRate_hz);
    const int hold = static_cast<int>(random.uniform(1.0, 2.0) * kRate_hz);
    const auto begin = static_cast<int>(rows.size());
    out.segments.push_back({begin, begin + move + hold, labels[label]});
    for (int t = 1; t <= move; ++t) {
      rows.push_back(pose + (target - pose) * minimum_jerk(static_cast<double>(t) / move));
    }
    pose = target;
    for (int t = 0; t < hold; ++t) {
      for (int c = 0; c < kHandChannels; ++c) {
        if (mean[c] != 0.0) pose[c] += 0.15 * kRadians * random.normal();
      }
      rows.push_back(pose);
    }
    label = (label + 1 + random.below(2)) % 3;
  }
  out.angles_rad = stacked(rows);
  for (int c = 0; c < kHandChannels; ++c) {
    if (out.angles_rad.col(c).isZero(0.0)) continue;
    for (double& value : out.angles_rad.col(c)) value += 0.3 * kRadians * random.normal();
  }
  return out;
}

}  // namespace posed::test
