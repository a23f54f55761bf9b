// Rock, paper, scissors, match and well of twenty real people who wore a Senso glove, ten takes
// each; the glove measures a bend and a spread for each finger.
#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "models/random.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"
#include "proto/text/load_file.hpp"

namespace posed::test {

// [gesture, small letters] its poses, 45 angles each in rad.
using PersonsHands = std::map<std::string, std::vector<Eigen::RowVectorXd>>;

// The order of a take's values: thumb yaw, pitch, quaternion, bend; yaw and pitch of each finger.
inline Eigen::RowVectorXd senso_hand(const std::vector<double>& value) {
  Eigen::RowVectorXd hand = Eigen::RowVectorXd::Zero(kHandChannels);
  hand[0] = value[1] * kDegree;
  hand[1] = value[0] * kDegree;
  hand[3] = 0.3 * value[6];
  hand[6] = 0.2 * value[6];
  for (int finger = 1; finger < kFingers; ++finger) {
    const double bend_rad = value[static_cast<std::size_t>(6 + 2 * finger)] * kDegree;
    const double yaw_deg = value[static_cast<std::size_t>(5 + 2 * finger)];
    const int first = finger * kFingerChannels;
    hand[first + 1] = yaw_deg * kDegree;
    hand[first] = hand[first + 3] = 0.4 * bend_rad;
    hand[first + 6] = 0.2 * bend_rad;
  }
  return hand;
}

inline PersonsHands senso_person(const std::filesystem::path& folder) {
  constexpr std::size_t kValues = 15;
  PersonsHands hands;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    std::string name;
    for (const char c : stem.substr(0, stem.find_first_of("0123456789"))) {
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    std::string text = load_file(entry.path(), {"recording", std::uintmax_t{1} << 20}).value();
    std::ranges::replace(text, ',', '.');
    std::istringstream lines(text);
    std::vector<double> values;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream number(line);
      double value = 0.0;
      if (!(number >> value)) continue;  // the names at the top, and blank lines
      values.push_back(value);
      if (values.size() < kValues) continue;
      hands[name].push_back(senso_hand(values));
      values.clear();
    }
  }
  return hands;
}

// The person's takes of these gestures strung together at 30 Hz in an order that the seed
// determines: minimum-jerk moves of 0.3 to 0.6 s, holds of about `hold_s`, 0.3 degrees of noise.
inline gesture::Recording strung(const PersonsHands& hands, const std::vector<std::string>& names,
                                 std::uint32_t seed, double hold_s) {
  constexpr double kRate_hz = 30.0;
  PortableRandom random(seed);
  std::vector<std::pair<std::string, Eigen::RowVectorXd>> order;
  for (const std::string& name : names) {
    for (const auto& pose : hands.at(name)) order.emplace_back(name, pose);
  }
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  }
  std::vector<Eigen::RowVectorXd> rows;
  gesture::Recording out{.file = "people", .rate_hz = kRate_hz, .angles_rad = {}, .segments = {}};
  Eigen::RowVectorXd from = order.front().second;
  for (const auto& [name, pose] : order) {
    const auto begin = static_cast<int>(rows.size());
    const int move = static_cast<int>(random.uniform(0.3, 0.6) * kRate_hz);
    const int hold = static_cast<int>(random.uniform(0.7, 1.3) * hold_s * kRate_hz);
    for (int t = 1; t <= move + hold; ++t) {
      const double u = std::min(static_cast<double>(t) / move, 1.0);
      rows.emplace_back(from + u * u * u * (10.0 - u * (15.0 - 6.0 * u)) * (pose - from));
    }
    from = pose;
    out.segments.push_back({begin, begin + move + hold, name});
  }
  out.angles_rad.resize(static_cast<Eigen::Index>(rows.size()), kHandChannels);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    for (Eigen::Index c = 0; c < kHandChannels; ++c) {
      out.angles_rad(static_cast<Eigen::Index>(t), c) =
          rows[t][c] + (rows[t][c] == 0.0 ? 0.0 : 0.3 * kDegree * random.normal());
    }
  }
  return out;
}

}  // namespace posed::test
