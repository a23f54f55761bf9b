#include "tests/support/real_pose_corpus.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/cyberglove/protocol.hpp"
#include "drivers/glove/calibration_file.hpp"
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

// A row's angles as a CyberGlove's map makes a hand of them. `angle` are the maker's library's,
// flexion negative.
RowVectorXd hand_of(const drivers::glove::Calibration& glove, std::span<const double> angle) {
  namespace cyberglove = drivers::cyberglove;
  std::array<float, cyberglove::kSensors> value{};
  std::ranges::copy(angle, value.begin());
  // The recorder counted them away from the library, whose abduction is positive towards the thumb.
  for (const auto i : {cyberglove::kIndexAbd, cyberglove::kMiddleAbd, cyberglove::kRingAbd,
                       cyberglove::kLittleAbd}) {
    value[i] = -value[i];
  }
  std::bitset<drivers::glove::kMaxSensors> measured;
  measured.set();
  HandAngles hand;
  glove.map_to_hand(value, measured, hand);
  return Eigen::Map<const RowVectorXd>(hand.data(), std::ssize(hand));
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

std::vector<std::vector<double>> libras_rows(const std::filesystem::path& folder,
                                             const std::string& sign) {
  const std::string text =
      load_file(folder / (sign + ".csv"), {"recording", std::uintmax_t{1} << 30}).value();
  std::vector<std::vector<double>> rows;
  for (std::string_view left = text; !left.empty();) {
    std::vector<double> row = numbers_of(clip::next_line(left));
    if (row.size() < kLibrasAngles) continue;
    row.resize(kLibrasAngles);  // a digit's name is a number, too
    rows.push_back(std::move(row));
  }
  if (rows.empty()) throw std::runtime_error("no poses of " + sign);
  return rows;
}

FeatureMatrix libras_poses(const std::filesystem::path& folder, const std::string& sign) {
  const auto glove =
      drivers::glove::default_calibration(drivers::cyberglove::glove_model(Side::kRight).value())
          .value();
  std::vector<RowVectorXd> rows;
  for (const auto& row : libras_rows(folder, sign)) rows.push_back(hand_of(*glove, row));
  return stacked(rows);
}

double best_composition_deg(const std::filesystem::path& folder, const std::string& label) {
  const auto mean = [&](const std::string& of) {
    return RowVectorXd(libras_poses(folder, kSignOf.at(of)).colwise().mean() / kRadians);
  };
  const RowVectorXd real = mean(label);
  const std::array<RowVectorXd, 3> recorded{mean("g"), mean("c"), mean("p")};
  double squared = 0.0;
  for (int finger = 1; finger < kFingers; ++finger) {
    double least = std::numeric_limits<double>::infinity();
    for (const RowVectorXd& pose : recorded) {
      double off = 0.0;
      for (int joint = 0; joint < kFingerJoints; ++joint) {
        const int flexion = finger * kFingerChannels + 3 * joint;
        off += std::pow(pose[flexion] - real[flexion], 2);
      }
      least = std::min(least, off);
    }
    squared += least;
  }
  return std::sqrt(squared / ((kFingers - 1) * kFingerJoints));
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
