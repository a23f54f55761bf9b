// Real glove poses through the constraint stage: ordinary poses change little.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "models/hand/constraint_solver.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/hand/hand_poses.hpp"

namespace posed::hand {
namespace {

using test::angle;

constexpr int kRing = 3, kLittle = 4;

// Rms over the poses of a sign, degrees.
struct Change {
  double flexion_deg = 0.0;  // of the four fingers
  double spread_deg = 0.0;   // of their knuckles
  double thumb_deg = 0.0;    // flexion
  double worst_gap_mm = 1e3;
  int retreats = 0;
};

// The corpus gives the spread of ring and little as a plain rotation, positive towards the thumb;
// in hand45 it is positive away from the middle finger. `turned` converts it to hand45.
Change change_of(const gesture::FeatureMatrix& poses, bool turned) {
  Change change;
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    ConstraintSolver solver;
    HandAngles raw;
    for (std::size_t c = 0; c < raw.size(); ++c) raw[c] = poses(i, static_cast<Eigen::Index>(c));
    if (turned) {
      for (const int finger : {kRing, kLittle}) raw[angle(finger, 0, 1)] *= -1.0;
    }
    HandAngles angles = raw;
    const ConstraintReport report = solver.step(angles, test::same_variance());
    change.retreats += report.retreated ? 1 : 0;
    change.worst_gap_mm = std::min(change.worst_gap_mm, 1e3 * report.min_gap_m);
    for (std::size_t c = 0; c < angles.size(); ++c) {
      const double squared = std::pow((angles[c] - raw[c]) / kDegree, 2);
      if (c % 3 == 0) {
        (c < kFingerChannels ? change.thumb_deg : change.flexion_deg) +=
            squared / (c < kFingerChannels ? 3 : 12);
      } else if (c % kFingerChannels == 1 && c > kFingerChannels) {
        change.spread_deg += squared / 4;
      }
    }
  }
  for (double* const sum : {&change.flexion_deg, &change.spread_deg, &change.thumb_deg}) {
    *sum = std::sqrt(*sum / static_cast<double>(poses.rows()));
  }
  return change;
}

}  // namespace

TEST_CASE("ordinary real poses are changed little") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  std::ostringstream table;
  table.precision(2);
  table << std::fixed;
  for (const std::string sign : {"A", "V", "4", "G", "W", "B", "D", "F", "I", "L", "U", "Y", "R"}) {
    INFO(sign);
    const auto poses = test::libras_poses(*folder, sign);
    for (const bool turned : {true, false}) {
      const Change change = change_of(poses, turned);
      table << "  " << sign << (turned ? " spread as hand45's " : " as written         ")
            << change.flexion_deg << ' ' << change.spread_deg << ' ' << change.thumb_deg << ' '
            << change.worst_gap_mm << ' ' << change.retreats << '\n';
      CHECK(change.worst_gap_mm >= 0.0);
      if (turned) {
        // Thumbs that oppose touch fingers in most of these signs.
        CHECK(change.flexion_deg < 1.0);
        CHECK(change.spread_deg < 6.2);
        CHECK(change.retreats < 40);
      }
    }
  }
  WARN(
      "rms change of finger flexion, spread, thumb flexion [deg], worst gap after [mm], poses "
      "straightened, of 100 poses a sign\n"
      << table.str());
}

}  // namespace posed::hand
