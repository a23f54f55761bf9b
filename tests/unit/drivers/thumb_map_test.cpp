// What a CyberGlove's and a VMG30's thumb reaches with the maps that posed has built in.
#include <catch2/catch.hpp>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/cyberglove/protocol.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/options.hpp"
#include "models/hand/constraint_solver.hpp"
#include "models/hand/thumb_fit.hpp"
#include "tests/support/grasps.hpp"
#include "tests/support/hand_signs.hpp"
#include "tests/support/shared.hpp"

namespace posed {
namespace {

using drivers::glove::Calibration;

std::shared_ptr<const Calibration> cyberglove() {
  return drivers::glove::default_calibration(drivers::cyberglove::glove_model(Side::kRight).value())
      .value();
}

struct Nearest {
  double index_mm = 1e3, middle_mm = 1e3;
  void take(const hand::HandGeometry& geometry, const HandAngles& angles) {
    index_mm = std::min(index_mm, 1e3 * hand::thumb_gap_m(geometry, angles, 1));
    middle_mm = std::min(middle_mm, 1e3 * hand::thumb_gap_m(geometry, angles, 2));
  }
};

}  // namespace

TEST_CASE("a CyberGlove's thumb touches in a real sign what the sign touches") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  const hand::HandGeometry geometry = hand::hand_geometry(default_hand_shape());
  double sum_mm = 0.0, kept_mm = 0.0;
  int count = 0;
  std::ostringstream table;
  for (const test::ThumbSign& sign : test::kThumbSigns) {
    for (const HandAngles& angles : test::sign_poses(*folder, sign.name)) {
      HandAngles apart = angles;
      HandAngles variance;
      variance.fill(1.0);
      hand::ConstraintSolver().step(apart, variance);
      CHECK(hand::min_gap_m(geometry, apart) >= 0.0);
      for (int finger = 1; finger < kFingers; ++finger) {
        if (!sign.touched[static_cast<std::size_t>(finger)]) continue;
        const double gap_mm = 1e3 * hand::thumb_gap_m(geometry, angles, finger);
        const double after_mm = 1e3 * hand::thumb_gap_m(geometry, apart, finger);
        table << sign.name << ' ' << kFingerNames[static_cast<std::size_t>(finger)] << ' ' << gap_mm
              << " -> " << after_mm << " mm\n";
        sum_mm += std::abs(gap_mm);
        kept_mm += after_mm;
        ++count;
      }
    }
  }
  WARN(table.str() << "mean " << sum_mm / count << " mm, kept apart " << kept_mm / count << " mm");
  CHECK(sum_mm / count < 8.0);   // 43 where the thumb rolls about its own length
  CHECK(kept_mm / count < 8.0);  // the fingers part, and the pads stay together
}

TEST_CASE("a CyberGlove's thumb comes to the fingers where real hands grasp") {
  const auto folder = test::shared("data/gloves/graspdb14_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  const auto calibration = cyberglove();
  const hand::HandGeometry geometry = hand::hand_geometry(default_hand_shape());
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    if (entry.path().extension() != ".txt") continue;
    Nearest nearest;
    hand::ConstraintSolver solver;
    const auto rows = test::read_grasp_rows(entry.path());
    for (std::size_t row = 0; row < rows.size(); row += 10) {
      std::array<float, drivers::cyberglove::kSensors> value{};
      std::ranges::transform(rows[row], value.begin(),
                             [](double v) { return static_cast<float>(v); });
      std::bitset<drivers::glove::kMaxSensors> measured;
      measured.set();
      HandAngles angles;
      calibration->map_to_hand(value, measured, angles);
      HandAngles variance;
      variance.fill(1.0);
      solver.step(angles, variance);
      nearest.take(geometry, angles);
    }
    INFO(entry.path().filename());
    WARN(entry.path().filename() << ": nearest to index " << nearest.index_mm << ", to middle "
                                 << nearest.middle_mm << " mm");
    CHECK(nearest.index_mm < 6.0);
    CHECK(nearest.middle_mm < 12.0);
    ++files;
  }
  CHECK(files > 0);
}

// Half of the sensors say nothing in these takes: the thumb's crossing and its last joint are at
// their ends throughout.
TEST_CASE("a VMG30's thumb comes to the fingers where a real hand grasps") {
  const auto folder = test::shared("data/gloves/vmg30_grasps");
  if (!folder) SKIP_WITHOUT_SHARED();
  const drivers::Driver& driver = *drivers::find_driver("described");
  const auto options = drivers::complete_options(driver, {{"device", "vmg30"}}).value();
  const auto model = driver.glove->glove_model(driver.expect(options).value()).value();
  const auto calibration = drivers::glove::default_calibration(model).value();
  // [column of the file] after the clocks; the glove's order on the wire.
  const std::map<std::string, std::size_t> column{
      {"thumb_ip", 0},   {"thumb_mcp", 1},  {"index_pip", 2},  {"index_mcp", 3},
      {"middle_pip", 4}, {"middle_mcp", 5}, {"ring_pip", 6},   {"ring_mcp", 7},
      {"little_pip", 8}, {"little_mcp", 9}, {"palm_arch", 10}, {"thumb_cross", 12},
      {"thumb_abd", 19}, {"index_abd", 20}, {"ring_abd", 21},  {"little_abd", 22}};
  const hand::HandGeometry geometry = hand::hand_geometry(default_hand_shape());
  double index_mm = 0.0, middle_mm = 0.0;
  int takes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    if (entry.path().extension() != ".txt") continue;
    std::ifstream file(entry.path());
    Nearest nearest;
    hand::ConstraintSolver solver;
    int row = 0;
    for (std::string line; std::getline(file, line);) {
      if (row++ % 10 != 0) continue;
      std::ranges::replace(line, ',', ' ');
      std::istringstream words(line);
      std::vector<double> values;
      for (double value = 0.0; words >> value;) values.push_back(value);
      if (values.size() < 25) continue;
      std::array<float, drivers::glove::kMaxSensors> value{};
      std::bitset<drivers::glove::kMaxSensors> valid;
      for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        const auto at = column.find(model.sensors[i].name);
        if (at == column.end()) continue;
        value[i] = model.sensors[i].curve.value_at(static_cast<float>(values[2 + at->second]));
        valid[i] = true;
      }
      HandAngles angles;
      calibration->map_to_hand(value, valid, angles);
      HandAngles variance;
      variance.fill(1.0);
      solver.step(angles, variance);
      nearest.take(geometry, angles);
    }
    index_mm += nearest.index_mm;
    middle_mm += nearest.middle_mm;
    ++takes;
  }
  REQUIRE(takes > 0);
  WARN("nearest to index " << index_mm / takes << ", to middle " << middle_mm / takes
                           << " mm, mean of " << takes << " takes");
  CHECK(index_mm / takes < 6.0);
  CHECK(middle_mm / takes < 12.0);
}

}  // namespace posed
