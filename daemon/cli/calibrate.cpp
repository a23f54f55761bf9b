// `posed calibrate`: a user's glove from a few poses, or from another program's file.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "daemon/cli/calibrate_poses.hpp"
#include "daemon/cli/cli.hpp"
#include "daemon/cli/driver_options.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/import.hpp"
#include "proto/clip/text.hpp"

namespace posed::cli {
namespace {

using drivers::glove::CalibrationFile;
using drivers::glove::kPoseHints;
using drivers::glove::kPoseNames;
using drivers::glove::Pose;

constexpr double kMostSeconds = 60.0;

struct CalibrateOptions {
  std::string driver, port, id, stream, user, hand = "right";
  std::filesystem::path import, out;
  std::vector<std::string> set;    // KEY=VALUE
  std::vector<std::string> poses;  // POSE=SECONDS
  double seconds = 0.0;            // 0: Enter begins each pose
  ClientOptions client;
  bool live = false;
};

Result<const drivers::Driver*> named_driver(const std::string& name) {
  const drivers::Driver* driver = drivers::find_driver(name);
  if (driver != nullptr && driver->glove_model != nullptr) return driver;
  std::string known;
  for (const drivers::Driver& other : drivers::registry()) {
    if (other.glove_model != nullptr)
      known += (known.empty() ? "" : ", ") + std::string(other.name);
  }
  return misuse("--driver names the glove's driver, one of " + known);
}

Result<drivers::Options> driver_options(const drivers::Driver& driver,
                                        const CalibrateOptions& options) {
  std::vector<std::string> words = options.set;
  words.push_back("hand=" + options.hand);
  if (!options.port.empty()) words.push_back("port=" + options.port);
  if (!options.id.empty()) words.push_back("id=" + options.id);
  return parse_driver_options(driver, words);
}

Result<PosePlan> plan_of(const CalibrateOptions& options) {
  PosePlan plan;
  if (options.seconds > 0.0) plan.seconds.fill(options.seconds);
  for (const std::string& word : options.poses) {
    const auto equals = word.find('=');
    const auto name = std::ranges::find(kPoseNames, std::string_view(word).substr(0, equals));
    double seconds = -1.0;
    if (equals != std::string::npos) {
      const char* const end = word.data() + word.size();
      const auto [stop, error] = std::from_chars(word.data() + equals + 1, end, seconds);
      if (error != std::errc() || stop != end) seconds = -1.0;
    }
    if (name == kPoseNames.end() || !(seconds >= 0.0 && seconds <= kMostSeconds)) {
      return misuse("'" + word + "': --pose is flat, fist, thumb or spread =SECONDS, 0 to 60");
    }
    plan.seconds[static_cast<std::size_t>(name - kPoseNames.begin())] = seconds;
  }
  if (plan.seconds[0] <= 0.0) return misuse("the flat hand cannot be left out");
  return plan;
}

// A line on stdin; false at its end or on Ctrl-C.
bool wait_for_enter() {
  while (!Interrupt::came()) {
    pollfd wanted{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (::poll(&wanted, 1, static_cast<int>(kLookAround.count())) <= 0) continue;
    char c = 0;
    if (::read(STDIN_FILENO, &c, 1) != 1) return false;
    if (c == '\n') return true;
  }
  return false;
}

// Without --seconds a line on stdin begins the pose, so that a script can set the pace, too.
bool ask_user(Pose pose, bool wait) {
  const auto index = static_cast<std::size_t>(pose);
  std::printf("pose %s\n", std::string(kPoseNames[index]).c_str());
  std::fflush(stdout);
  std::fprintf(stderr, "%s: %s%s\n", std::string(kPoseNames[index]).c_str(),
               std::string(kPoseHints[index]).c_str(), wait ? "; then press Enter" : "");
  return !wait || wait_for_enter();
}

Result<CalibrationFile> from_poses(const CalibrateOptions& options, Side hand) {
  const auto plan = plan_of(options);
  if (!plan) return std::unexpected(plan.error());
  const drivers::Driver* driver = nullptr;
  if (!options.live || !options.driver.empty()) {
    const auto named = named_driver(options.driver);
    if (!named) return std::unexpected(named.error());
    driver = *named;
  }
  Result<std::unique_ptr<GloveSource>> source = nullptr;
  if (options.live) {
    source = GloveSource::connect(options.client, options.stream, driver, hand);
  } else {
    const auto completed = driver_options(*driver, options);
    if (!completed) return std::unexpected(completed.error());
    source = GloveSource::open(*driver, *completed);
  }
  if (!source) return std::unexpected(source.error());
  SensorBars bars((*source)->model());
  const auto recorded = record_poses(
      **source, *plan,
      [&](Pose pose) {
        bars.end();
        return ask_user(pose, options.seconds <= 0.0);
      },
      [&](const auto& raw, const auto& valid) { bars.show(raw, valid); });
  if (!recorded) return std::unexpected(recorded.error());
  auto fitted = drivers::glove::fit_poses((*source)->model(), *recorded);
  if (!fitted) return std::unexpected(fitted.error());
  for (const std::string& warning : fitted->warnings) {
    std::fprintf(stderr, "posed: warning: %s\n", warning.c_str());
  }
  // A port's path is no glove's identity: the same glove may be plugged in elsewhere tomorrow.
  const std::string& identity = (*source)->identity();
  return CalibrationFile{.driver = (*source)->model().driver,
                         .glove = identity.starts_with('/') ? std::string() : identity,
                         .user = {},
                         .hand = hand,
                         .parameters = {},
                         .sensors = std::move(fitted->sensors)};
}

Result<CalibrationFile> from_file(const CalibrateOptions& options, Side hand) {
  const auto driver = named_driver(options.driver.empty() ? "cyberglove" : options.driver);
  if (!driver) return std::unexpected(driver.error());
  const auto completed = driver_options(**driver, options);
  if (!completed) return std::unexpected(completed.error());
  const auto description = (*driver)->expect(*completed);
  if (!description) return std::unexpected(description.error());
  const auto model = (*driver)->glove_model(*description);
  if (!model) return std::unexpected(model.error());
  return drivers::glove::import_calibration(options.import, *model, hand);
}

Result<> calibrate(const CalibrateOptions& options) {
  const Interrupt interrupt;
  const Side hand = options.hand == "left" ? Side::kLeft : Side::kRight;
  if (options.live && options.stream.empty()) return misuse("--connect also needs --stream");
  auto file = options.import.empty() ? from_poses(options, hand) : from_file(options, hand);
  if (!file) return std::unexpected(file.error());
  file->user = options.user;
  const std::string text = drivers::glove::format_calibration(*file);
  auto written = clip::write_text(options.out, [&](std::ostream& out) { out << text; });
  if (!written) return written;
  std::fprintf(stderr, "%zu sensors calibrated: %s\n", file->sensors.size(),
               options.out.string().c_str());
  return {};
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("calibrate", "Fit a glove to its user, by a few poses");
  auto options = std::make_shared<CalibrateOptions>();
  add_client_options(*command, options->client, "tcp://127.0.0.1:5570");
  auto* connect = command->get_option("--connect");
  command->add_option("--stream", options->stream, "The glove's stream in the daemon")
      ->type_name("NAME");
  command->add_option("--driver", options->driver, "The glove's driver")->type_name("NAME");
  auto* port = command->add_option("--port", options->port, "Its port, such as /dev/ttyUSB0");
  port->type_name("PORT")->excludes(connect);
  command->add_option("--id", options->id, "Its id, as posed devices lists it")
      ->type_name("ID")
      ->excludes(connect);
  command->add_option("--set", options->set, "An option of the driver, like baud=38400")
      ->type_name("KEY=VALUE");
  command->add_option("--user", options->user, "Whose hand it is")->required();
  command->add_option("--hand", options->hand, "right or left")
      ->capture_default_str()
      ->check(CLI::IsMember({"right", "left"}));
  command->add_option("--import", options->import, "Another program's calibration, no poses")
      ->type_name("FILE");
  command->add_option("--seconds", options->seconds, "Begin each pose by itself, this long")
      ->check(CLI::Range(0.1, kMostSeconds));
  command->add_option("--pose", options->poses, "How long one pose is held; 0 leaves it out")
      ->type_name("POSE=SECONDS");
  command->add_option("--out", options->out, "The calibration to write")
      ->type_name("C.toml")
      ->required();
  command->footer(R"(Poses: flat, fist, thumb, spread. Examples:
  posed calibrate --driver cyberglove --port /dev/ttyUSB0 --user ann --out ann.toml
  posed calibrate --connect tcp://127.0.0.1:5570 --stream right --user ann --out ann.toml
  posed calibrate --driver cyberglove --import old.cal --user ann --out ann.toml)");
  command->callback([options, connect, &exit_code] {
    options->live = connect->count() > 0;
    if (auto done = calibrate(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
