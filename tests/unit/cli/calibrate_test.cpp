// `posed calibrate` on an emulated glove behind a pseudo-terminal: from poses to angles.
#include <catch2/catch.hpp>

#include <atomic>
#include <thread>

#include "daemon/cli/calibrate_poses.hpp"
#include "daemon/devices/emulated_glove.hpp"
#include "drivers/driver.hpp"

namespace posed::cli {
namespace {

using drivers::glove::Pose;

// A glove whose hand does as it is told.
class Performer {
 public:
  Performer()
      : glove_(drivers::find_driver("cyberglove")->emulate({}).value(),
               devices::EmulatedPort::open_pty({}).value(),
               [this](double) { return drivers::glove::hand_in(pose_.load()); }, {}),
        thread_([this](const std::stop_token& stop) { glove_.run(stop); }) {}
  [[nodiscard]] std::string port() const { return glove_.port(); }
  void hold(Pose pose) { pose_ = pose; }

 private:
  std::atomic<Pose> pose_{Pose::kFlat};
  devices::EmulatedGlove glove_;
  std::jthread thread_;
};

}  // namespace

TEST_CASE("a glove calibrated by poses reads the angles of those poses") {
  Performer performer;
  const drivers::Driver& driver = *drivers::find_driver("cyberglove");
  auto source = GloveSource::open(driver, {{"port", performer.port()}});
  if (!source) FAIL(source.error().text());
  std::vector<Pose> asked;
  std::size_t shown = 0;
  const auto recorded = record_poses(
      **source, {.seconds = {0.2, 0.2, 0.2, 0.2}, .settle_s = 0.3},
      [&](Pose pose) {
        asked.push_back(pose);
        performer.hold(pose);
        return true;
      },
      [&](const auto&, const auto&) { ++shown; });
  if (!recorded) FAIL(recorded.error().text());
  CHECK(asked == std::vector{Pose::kFlat, Pose::kFist, Pose::kThumb, Pose::kSpread});
  CHECK(shown > 4);
  const auto& model = (*source)->model();
  const auto fitted = drivers::glove::fit_poses(model, *recorded);
  if (!fitted) FAIL(fitted.error().text());
  CHECK(fitted->warnings.empty());
  // The emulator's gains are the driver's defaults: the fit finds them again, to a count's
  // rounding.
  for (const auto& [name, points] : fitted->sensors) {
    INFO(name);
    const auto sensor = std::ranges::find(model.sensors, name, &drivers::glove::Sensor::name);
    REQUIRE(sensor != model.sensors.end());
    for (const auto& point : points) {
      const auto by_default =
          static_cast<double>(sensor->curve.value_at(static_cast<float>(point[0])));
      CHECK(by_default == Approx(point[1]).margin(0.02));
    }
  }
  CHECK(fitted->sensors.size() >= 18);
}

TEST_CASE("a calibration that the user gives up writes nothing, and says so") {
  Performer performer;
  auto source =
      GloveSource::open(*drivers::find_driver("cyberglove"), {{"port", performer.port()}});
  REQUIRE(source);
  const auto recorded =
      record_poses(**source, {}, [](Pose) { return false; }, [](const auto&, const auto&) {});
  REQUIRE_FALSE(recorded);
  CHECK(recorded.error().message.contains("no calibration was written"));
}

}  // namespace posed::cli
