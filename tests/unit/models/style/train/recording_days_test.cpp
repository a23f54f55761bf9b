// Days are followed only where held-out takes confirm them, whatever the numbers of takes.
#include "models/style/train/recording_days.hpp"

#include <catch2/catch.hpp>

using namespace posed;

namespace {

// One person's takes; each cycle is a constant pose in three dimensions.
struct OnePerson {
  style::Dataset dataset;
  std::vector<style::ClipCycle> takes;

  OnePerson() { dataset.subjects.push_back({"ann", "from", "walk", {}}); }

  void add(const std::string& group, const Eigen::RowVector3d& pose) {
    style::AlignedClip clip;
    clip.group = group;
    clip.motion = "walk";
    dataset.clips.push_back(clip);
    Eigen::MatrixXd cycle = Eigen::MatrixXd::Zero(2 * style::kCycleHarmonics + 1, 3);
    cycle.row(0) = pose;
    takes.push_back({static_cast<int>(takes.size()), cycle});
  }

  [[nodiscard]] bool follows() const {
    return !style::day_changes(dataset, takes, {}, "to").empty();
  }
};

}  // namespace

TEST_CASE("a take does not confirm a day by its neighbour with the same partner",
          "[style][people]") {
  OnePerson ann;
  for (const double at : {0.0, 0.01, 1.0, 1.01, 2.0, 2.01}) ann.add("from", {at, 0.0, 0.0});
  // The three targets have nothing to do with the sources.
  for (int t = 0; t < 3; ++t) ann.add("to", Eigen::RowVector3d::Unit(t));
  CHECK_FALSE(ann.follows());
}

TEST_CASE("two days are followed with other numbers of source takes than of target takes",
          "[style][people]") {
  OnePerson ann;
  for (const double day : {0.0, 1.0}) {
    for (const double take : {0.0, 0.01, 0.02, 0.03}) ann.add("from", {day + take, 0.0, 0.0});
    for (const double take : {0.0, 0.01}) ann.add("to", {0.0, day, take});
  }
  CHECK(ann.follows());
}
