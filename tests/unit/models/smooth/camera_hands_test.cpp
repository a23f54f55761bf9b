// Whether gestures are named of hands as a camera's tracker sees them.
#include <array>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gesture/camera_takes.hpp"
#include "models/gesture/train.hpp"
#include "tests/support/live_hand.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

constexpr double kTracked_hz = 10.0;

// Drawn hands that no model was taught (viewer/test/support/drawn_hands.cpp, mode signs, seeds 603,
// 606, 609 and 612, the even ones left hands): gesture, whether it is held, 19 angles [deg] or -
// where the driver could not read the hand on its own side.
struct TrackedTake {
  Motion angles;  // [frames x 45] deg; of pictures without a hand NaN
  std::vector<std::string> label;
  std::vector<bool> judged;  // held
};

TrackedTake tracked_take(int number) {
  constexpr std::array<int, 19> kAngle{2,  3,  6,  1,  9,  12, 15, 10, 18, 21,
                                       24, 27, 30, 33, 28, 36, 39, 42, 37};
  std::ifstream file(golden("camera/judge_" + std::to_string(number) + ".txt"));
  std::vector<Eigen::RowVectorXd> rows;
  TrackedTake take;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string label;
    bool held = false;
    double first = 0.0;
    words >> label >> held;
    const bool found = static_cast<bool>(words >> first);
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Constant(
        kHandChannels, found ? 0.0 : std::numeric_limits<double>::quiet_NaN());
    if (found) row[kAngle[0]] = first;
    for (std::size_t i = 1; found && i < kAngle.size(); ++i) words >> row[kAngle[i]];
    rows.push_back(row);
    take.label.push_back(label);
    take.judged.push_back(held);
  }
  take.angles.resize(static_cast<Eigen::Index>(rows.size()), kHandChannels);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    take.angles.row(static_cast<Eigen::Index>(t)) = rows[t];
  }
  return take;
}

std::unique_ptr<const smooth::LiveModel> taught(
    const std::vector<gesture::Performance>& performances, double rate_hz, bool held) {
  std::vector<gesture::Recording> recordings;
  for (const gesture::Performance& performance : performances) {
    recordings.push_back(gesture::recording_of(performance.clip, rate_hz).value());
    gesture::cut(recordings.back(), performance.labels, "takes").value();
  }
  const auto model = gesture::train_gesture(recordings, {.held = held}).value();
  return smooth::bind_live_model(model, hand_skeleton(Side::kRight), "taught").value();
}

// The share of the judged frames that are named right; only those of `asked`.
double named(const smooth::LiveModel& model, double error_deg, const std::string& asked) {
  smooth::LiveOptions options;
  options.error_rad = error_deg * kDegree;
  double right = 0.0, frames = 0.0;
  for (int number = 1; number <= 4; ++number) {
    const TrackedTake take = tracked_take(number);
    REQUIRE(take.angles.rows() == 200);
    const auto reported = followed(take.angles, kTracked_hz, options, &model);
    for (std::size_t t = 0; t < take.label.size(); ++t) {
      if (!take.judged[t] || !asked.contains(take.label[t])) continue;
      right += reported.label[t] == take.label[t] ? 1.0 : 0.0;
      ++frames;
    }
  }
  return right / frames;
}

}  // namespace

TEST_CASE("a model that a camera taught names the gestures of other hands before it") {
  const auto model = taught(gesture::camera_takes(), gesture::kCameraRate_hz, true);
  const double share = named(*model, 10.0, "gcp134");
  INFO(share);
  CHECK(share >= 0.9);
}

TEST_CASE(
    "a model that a glove taught names a camera's gestures once it knows how wrong they are") {
  const auto model = taught({gesture::make_performance({}).value()}, 30.0, false);
  const double exact = named(*model, 0.0, "gcp"), aware = named(*model, 10.0, "gcp");
  INFO(exact << " " << aware);
  CHECK(exact < 0.6);
  CHECK(aware >= 0.75);
}

TEST_CASE("a hand's angle that jumps by more than half a turn comes back") {
  Motion angles = Motion::Zero(40, kHandChannels);
  angles.col(39).setConstant(-35.0);  // the little finger's second joint
  angles.block(10, 39, 2, 1).setConstant(165.0);
  const auto reported = followed(angles, kTracked_hz, live_options(1, 1.0), nullptr);
  CHECK(reported.angles(39, 39) == Approx(-35.0).margin(1.0));
}

}  // namespace posed::test
