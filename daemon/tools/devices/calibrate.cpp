// `posed calibrate`: calibrates a user's glove from a few poses, or from another program's file.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "daemon/devices/pose_calibration.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/devices/calibrate_poses.hpp"
#include "daemon/tools/devices/calibration_check.hpp"
#include "daemon/tools/devices/driver_options.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/crosstalk.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/import.hpp"
#include "drivers/glove/pose_check.hpp"
#include "drivers/glove/traits.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/number.hpp"

namespace posed::tools {
namespace {

using drivers::glove::CalibrationFile;
using drivers::glove::kPoseNames;

// Leads the user by a full-screen view, which the destructor removes from the terminal.
class PoseScreen final : public PoseGuide {
 public:
  // `note` is shown from the start; may be empty.
  PoseScreen(const drivers::glove::Model& model, const PosePlan& plan, std::string title,
             std::string note);

  void want(drivers::glove::Pose pose) override;
  [[nodiscard]] Word receive() override;
  void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
            double left_s, double whole_s) override;
  void restless(drivers::glove::Pose pose, const std::string& sensor) override;

 private:
  void draw();

  LiveScreen screen_;
  CalibrateView view_;
  bool ranging_ = false;  // a pose is or was held; from now on the range of each sensor is tracked
  std::chrono::steady_clock::time_point drawn_{}, received_{};
};

// Prints a line on stdout when a pose is wanted ("pose fist") and instructions on stderr. The user
// confirms with a line on stdin, unless the poses start by themselves.
class PoseLines final : public PoseGuide {
 public:
  explicit PoseLines(const PosePlan& plan) : waits_(!plan.ready_s) {}

  void want(drivers::glove::Pose pose) override;
  [[nodiscard]] Word receive() override;
  void show(const GloveSource::Raw& /*raw*/, const GloveSource::Valid& /*valid*/,
            PosePhase /*phase*/, double /*left_s*/, double /*whole_s*/) override {}
  void restless(drivers::glove::Pose pose, const std::string& sensor) override;

 private:
  bool waits_;
  bool may_skip_ = false;  // contacts and repeats are left
};

using drivers::glove::kPoseHints;
using drivers::glove::Pose;
using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kRedraw{66};
constexpr std::chrono::seconds kSilence{1};
constexpr double kNoiseShare = 0.04;  // share of a sensor's range

PoseScreen::PoseScreen(const drivers::glove::Model& model, const PosePlan& plan, std::string title,
                       std::string note) {
  view_.title = std::move(title);
  view_.note = std::move(note);
  view_.poses = plan.poses();
  for (const drivers::glove::Sensor& sensor : model.sensors) {
    view_.sensors.push_back({.name = sensor.name,
                             .least = sensor.raw_min,
                             .most = sensor.raw_max,
                             .least_span = kNoiseShare * (sensor.raw_max - sensor.raw_min)});
  }
  received_ = SteadyClock::now();
}

// Discards keys that were pressed before this pose was asked for: a superfluous Enter would start
// it.
void PoseScreen::want(Pose pose) {
  while (screen_.key_pressed() != 0) {
  }
  view_.pose = static_cast<std::size_t>(std::ranges::find(view_.poses, pose) - view_.poses.begin());
  view_.may_skip = drivers::glove::may_be_skipped(pose);
  view_.any_held = ranging_;
  view_.phase = PosePhase::kAsked;
  view_.left_s = view_.share = 0.0;
  draw();
}

PoseGuide::Word PoseScreen::receive() {
  if (SteadyClock::now() - drawn_ >= kRedraw) draw();
  for (char key = screen_.key_pressed(); key != 0; key = screen_.key_pressed()) {
    if (key == '\n' || key == '\r') return Word::kGo;
    if (key == 'b' || key == 'B') return Word::kBack;
    if (key == 'q' || key == 'Q') return Word::kStop;
    if (view_.may_skip && (key == 's' || key == 'S')) return Word::kEnough;
  }
  return Word::kNothing;
}

void PoseScreen::show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
                      double left_s, double whole_s) {
  received_ = SteadyClock::now();
  view_.phase = phase;
  view_.left_s = std::max(left_s, 0.0);
  view_.share = whole_s > 0.0 ? 1.0 - view_.left_s / whole_s : 0.0;
  if (phase != PosePhase::kAsked) view_.note.clear();  // it was about the previous pose
  const bool first_held = phase == PosePhase::kHeld && !ranging_;
  ranging_ = ranging_ || first_held;
  for (std::size_t i = 0; i < view_.sensors.size(); ++i) {
    if (!valid[i]) continue;
    SensorView& sensor = view_.sensors[i];
    sensor.value = static_cast<double>(raw[i]);
    if (first_held || !sensor.there || !ranging_) sensor.low = sensor.high = sensor.value;
    sensor.there = true;
    sensor.low = std::min(sensor.low, sensor.value);
    sensor.high = std::max(sensor.high, sensor.value);
  }
  if (SteadyClock::now() - drawn_ >= kRedraw) draw();
}

void PoseScreen::restless(Pose pose, const std::string& sensor) {
  view_.note = "The hand moved while " + std::string(kPoseNames[static_cast<std::size_t>(pose)]) +
               " was held (" + sensor + "). b: hold it again";
}

void PoseScreen::draw() {
  drawn_ = SteadyClock::now();
  view_.silent = drawn_ - received_ >= kSilence;
  LiveViewOptions size;
  screen_.measure(size);
  view_.width = size.width;
  view_.height = size.height;
  view_.colour = size.colour;
  screen_.draw(calibrate_view(view_));
}

void PoseLines::want(Pose pose) {
  may_skip_ = drivers::glove::may_be_skipped(pose);
  const auto index = static_cast<std::size_t>(pose);
  std::printf("pose %s\n", std::string(kPoseNames[index]).c_str());
  std::fflush(stdout);
  std::fprintf(stderr, "%s: %s%s\n", std::string(kPoseNames[index]).c_str(),
               std::string(kPoseHints[index]).c_str(), waits_ ? "; then press Enter" : "");
}

void PoseLines::restless(Pose pose, const std::string& sensor) {
  std::fprintf(stderr, "posed: warning: the hand moved while %s was held (%s)\n",
               std::string(kPoseNames[static_cast<std::size_t>(pose)]).c_str(), sensor.c_str());
}

PoseGuide::Word PoseLines::receive() {
  pollfd line{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  while (waits_ && ::poll(&line, 1, 0) > 0) {
    char c = 0;
    if (::read(STDIN_FILENO, &c, 1) != 1) {
      // A script of the four poses alone, as there were before.
      std::fprintf(stderr, "stdin has ended; %s\n",
                   may_skip_ ? "contacts and repeats are left out"
                             : "with --seconds each pose begins by itself");
      return may_skip_ ? Word::kEnough : Word::kStop;
    }
    if (c == '\n') return Word::kGo;
  }
  return Word::kNothing;
}

bool on_terminal() { return ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0; }

// On a terminal a full-screen view leads the user; it is removed before anything else is printed.
// `note` says why poses are asked for again; empty at first.
Result<drivers::glove::Recorded> lead(GloveSource& source, const PosePlan& plan,
                                      const std::string& user, const std::string& note) {
  if (!on_terminal()) {
    PoseLines lines(plan);
    return record_poses(source, plan, lines);
  }
  std::string title = "posed calibrate: " + source.model().driver + ", " +
                      std::string(drivers::glove::side_name(source.hand())) + " hand of " + user;
  if (!source.identity().empty()) title += ", " + source.identity();
  PoseScreen screen(source.model(), plan, clean(title), note);
  return record_poses(source, plan, screen);
}

struct GoodPoses {
  drivers::glove::Recorded recorded{};
  drivers::glove::PoseCheck check{};
};

// Leads the user through the poses with `user`. On a terminal, poses that failed are asked for
// again until the user gives up; otherwise they are an error that names each one and its fault.
// `force` accepts them all the same.
Result<GoodPoses> good_poses(GloveSource& source, const PosePlan& plan, const std::string& user,
                             bool force) {
  GoodPoses poses;
  poses.recorded = TRY(lead(source, plan, user, {}));
  while (true) {
    auto& check = poses.check;
    check = TRY(drivers::glove::check_poses(source.model(), poses.recorded));
    // Where nothing was measured the fit reports it.
    if (check.sensors == 0 || check.usable() || force) return poses;
    if (!on_terminal()) {
      return fail(check.verdict() +
                  "; no calibration was written (--force writes it all the same)");
    }
    PosePlan again = plan;
    again.seconds.fill(0.0);
    for (const auto pose : check.failed()) {
      again.seconds[static_cast<std::size_t>(pose)] = plan.seconds[static_cast<std::size_t>(pose)];
    }
    const auto more = TRY(lead(source, again, user, check.verdict()));
    for (const auto pose : again.poses()) {
      poses.recorded[static_cast<std::size_t>(pose)] = more[static_cast<std::size_t>(pose)];
    }
  }
}

// What the user does after the poses with --moves.
struct GuidedMove {
  const char *name, *hint;
};
constexpr GuidedMove kBend{
    "bend",
    "without spreading, bend and stretch one finger after the other, then all "
    "of them; twice, slowly"};
constexpr GuidedMove kSpreadMove{"spread",
                                 "fingers straight, spread and close them; four times, slowly"};
constexpr double kMove_s = 20.0;
constexpr double kMovePatience_s = 5.0;  // for a glove that sends nothing while the user reads

// Records a move, led by lines on a terminal, too: "move bend" on stdout, the hint on stderr; a
// line on stdin begins it, or the end of the time to get ready.
Result<drivers::glove::Move> record_move(GloveSource& source, const PosePlan& plan,
                                         const GuidedMove& wanted) {
  std::printf("move %s\n", wanted.name);
  std::fflush(stdout);
  std::fprintf(stderr, "%s: %s, for %.0f s%s\n", wanted.name, wanted.hint, kMove_s,
               plan.ready_s ? "" : "; then press Enter to begin");
  PoseLines lines(plan);
  auto word = PoseGuide::Word::kNothing;
  const auto begun = SteadyClock::now();
  const auto enough = [&] {
    word = lines.receive();
    const double past_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();
    if (plan.ready_s && past_s >= *plan.ready_s) word = PoseGuide::Word::kGo;
    return word != PoseGuide::Word::kNothing;
  };
  while (word == PoseGuide::Word::kNothing) {
    TRY(source.listen(kMovePatience_s, [](const auto&, const auto&) {}, enough));
  }
  if (word == PoseGuide::Word::kStop) return fail("stopped; no calibration was written");
  drivers::glove::Move move;
  const auto keep = [&move](const GloveSource::Raw& raw, const GloveSource::Valid& valid) {
    auto& frame = move.emplace_back(raw);
    for (std::size_t i = 0; i < frame.size(); ++i) {
      if (!valid[i]) frame[i] = std::numeric_limits<float>::quiet_NaN();
    }
  };
  TRY(source.listen(kMove_s, keep));
  return move;
}

Result<> fit_moves(GloveSource& source, const PosePlan& plan, CalibrationFile& file) {
  drivers::glove::Moves moves;
  moves.bend = TRY(record_move(source, plan, kBend));
  moves.spread = TRY(record_move(source, plan, kSpreadMove));
  const auto said = TRY(drivers::glove::fit_crosstalk(source.model(), moves, source.hand(), file));
  for (const std::string& line : said) std::fprintf(stderr, "posed: %s\n", line.c_str());
  if (said.empty()) std::fprintf(stderr, "posed: no sensor shows another's movement\n");
  return {};
}

constexpr double kMaxSeconds = 60.0;
constexpr int kHandColumns = 60, kHandRows = 10;  // of the picture of the calibrated hand

struct CalibrateOptions {
  std::string driver, port, id, stream, user;
  std::string hand;  // empty: right, or with --connect the stream's
  std::filesystem::path import, out;
  std::vector<std::string> set;    // KEY=VALUE
  std::vector<std::string> poses;  // POSE=SECONDS
  double seconds = 0.0;            // 0: the user starts each pose with Enter
  double ready_s = 3.0;            // time to change from pose to pose without a key
  ClientOptions client;
  bool live = false;
  bool ready_given = false;
  bool overwrite = false;
  bool brief = false;  // the four poses that fit the sensors, alone
  bool moves = false;  // two moves after the poses
  bool force = false;  // write the file although the check calls it unusable
};

Result<const drivers::Driver*> named_driver(const std::string& name) {
  const drivers::Driver* driver = drivers::find_driver(name);
  if (driver != nullptr && driver->glove != nullptr) return driver;
  std::string known;
  for (const drivers::Driver& other : drivers::registry()) {
    if (other.glove != nullptr) add_word(known, other.name);
  }
  return misuse("--driver names the glove's driver, one of " + known);
}

Result<drivers::Options> driver_options(const drivers::Driver& driver,
                                        const CalibrateOptions& options) {
  std::vector<std::string> words = options.set;
  words.push_back("hand=" + (options.hand.empty() ? "right" : options.hand));
  if (!options.port.empty()) words.push_back("port=" + options.port);
  if (!options.id.empty()) words.push_back("id=" + options.id);
  return parse_driver_options(driver, words);
}

Result<PosePlan> plan_of(const CalibrateOptions& options) {
  PosePlan plan;
  if (options.seconds > 0.0) {
    plan.seconds.fill(options.seconds);
    plan.ready_s = options.ready_s;
  }
  if (options.brief) plan.shorten();
  for (const std::string& word : options.poses) {
    const auto equals = word.find('=');
    const auto name = std::ranges::find(kPoseNames, std::string_view(word).substr(0, equals));
    const std::string_view number =
        equals == std::string::npos ? "" : std::string_view(word).substr(equals + 1);
    const double seconds = exact_number<double>(number).value_or(-1.0);
    if (name == kPoseNames.end() || !(seconds >= 0.0 && seconds <= kMaxSeconds)) {
      return misuse("'" + word + "': --pose is POSE=SECONDS, 0 to 60; the poses are " +
                    joined(kPoseNames));
    }
    plan.seconds[name - kPoseNames.begin()] = seconds;
  }
  if (plan.seconds[0] <= 0.0) return misuse("the flat hand cannot be left out");
  return plan;
}

// The glove of a running stream is already set up; options that would change it are an error.
Result<std::unique_ptr<GloveSource>> connect(const CalibrateOptions& options) {
  if (options.stream.empty()) return misuse("--connect also needs --stream");
  auto source = TRY(GloveSource::connect(options.client, options.stream));
  const std::string& driver = source->model().driver;
  const std::string_view hand = drivers::glove::side_name(source->hand());
  if (!options.driver.empty() && options.driver != driver) {
    return misuse("stream '" + options.stream + "' is of driver '" + driver +
                  "': leave out --driver");
  }
  if (!options.hand.empty() && options.hand != hand) {
    return misuse("stream '" + options.stream + "' is of a " + std::string(hand) +
                  " hand: name the other hand's stream, or leave out --hand");
  }
  return source;
}

// A glove that a daemon uses can be calibrated through that daemon, without ending it; the error
// says so.
Error with_way_through(Error error) {
  if (error.message.contains(" is in use")) {
    error.message +=
        "; or, if a posed daemon has it, go through that: posed calibrate --connect "
        "tcp://127.0.0.1:5570 --stream NAME (`posed top` shows the names)";
  }
  return error;
}

Result<std::unique_ptr<GloveSource>> open_glove(const CalibrateOptions& options) {
  if (options.live) return connect(options);
  const auto driver = TRY(named_driver(options.driver));
  const auto completed = TRY(driver_options(*driver, options));
  auto source = GloveSource::open(*driver, completed);
  if (!source) return std::unexpected(with_way_through(source.error()));
  return source;
}

// Draws the calibrated hand for a user at a terminal.
void show_hand(const GloveSource& source, const drivers::glove::Calibration& calibration,
               const drivers::glove::Recorded& recorded) {
  if (::isatty(STDERR_FILENO) == 0) return;
  std::fputs("the calibrated hand, in the poses as they were held:\n", stderr);
  for (const std::string& line : calibrated_hand(source.model(), calibration, source.hand(),
                                                 recorded, kHandColumns, kHandRows)) {
    std::fprintf(stderr, "%s\n", line.c_str());
  }
}

// How the new calibration differs from the one that the file holds so far, if that is of this
// glove, user and hand. One that is another hand's in most joints is an error, but for --force.
Result<> judge(const GloveSource& source, const CalibrateOptions& options,
               const CalibrationFile& file, const drivers::glove::Calibration& now,
               const drivers::glove::Recorded& recorded) {
  const auto& model = source.model();
  std::error_code ignored;
  if (!std::filesystem::exists(options.out, ignored)) return {};
  const auto text = drivers::glove::load_calibration_text(options.out);
  if (!text) return {};
  const auto last = drivers::glove::parse_calibration(*text, options.out);
  if (!last || last->user != options.user) return {};
  const auto before =
      drivers::glove::make_calibration(model, *last, source.hand(), source.identity());
  if (!before) return {};
  const Differences found = differences(model, **before, now, recorded);
  for (const std::string& line : found.sentences) {
    std::fprintf(stderr, "posed: %s\n", line.c_str());
  }
  if (!found.mostly_unlike() || options.force) return {};
  const std::string beside = options.out.string() + ".new";
  TRY(write_whole_file(beside, drivers::glove::format_calibration(file)));
  return fail(fmt::format(
      "{} of {} joints differ by more than 7 degrees from {}'s calibration in {}, which stays; the "
      "new one is in {}: rename it if it is the same hand, or use --force next time",
      found.unlike, found.joints, options.user, options.out.string(), beside));
}

Result<CalibrationFile> from_poses(const CalibrateOptions& options) {
  const auto plan = TRY(plan_of(options));
  const auto source = TRY(open_glove(options));
  auto [recorded, check] = TRY(good_poses(*source, plan, options.user, options.force));
  auto made = TRY(
      devices::calibrate_by_poses(source->model(), recorded,
                                  devices::blank_calibration(source->model(), source->identity(),
                                                             source->hand(), options.user)));
  for (const std::string& warning : made.warnings) {
    std::fprintf(stderr, "posed: warning: %s\n", warning.c_str());
  }
  for (const std::string& line : made.said) std::fprintf(stderr, "posed: %s\n", line.c_str());
  if (const std::string refusal = made.refusal(); !refusal.empty()) {
    if (!options.force) {
      return fail(refusal + "; no calibration was written (--force writes it all the same)");
    }
  }
  std::ranges::move(made.doubts, std::back_inserter(check.doubts));
  std::fprintf(stderr, "posed: %s%s\n", check.usable() ? "" : "warning: ", check.verdict().c_str());
  auto& file = made.file;
  if (options.moves) {
    TRY(fit_moves(*source, plan, file));
    made.calibration = TRY(drivers::glove::make_calibration(source->model(), file, source->hand(),
                                                            source->identity()));
  }
  TRY(judge(*source, options, file, *made.calibration, recorded));
  show_hand(*source, *made.calibration, recorded);
  return std::move(file);
}

// Without a device only the driver and the hand are known; through a daemon the glove is known,
// too.
Result<CalibrationFile> from_file(const CalibrateOptions& options) {
  if (options.live) {
    const auto source = TRY(connect(options));
    auto file = drivers::glove::import_calibration(options.import, source->model(), source->hand());
    if (file) {
      file->glove = devices::blank_calibration(source->model(), source->identity(), source->hand(),
                                               options.user)
                        .glove;
    }
    return file;
  }
  const auto driver = TRY(named_driver(options.driver.empty() ? "cyberglove" : options.driver));
  const auto completed = TRY(driver_options(*driver, options));
  const auto description = TRY(driver->expect(completed));
  const auto model = TRY(driver->glove->glove_model(description));
  const Side hand = side_named(options.hand);
  return drivers::glove::import_calibration(options.import, model, hand);
}

// Checked before the user goes through the poses. An option that would have no effect is refused.
Result<> check_options(const CalibrateOptions& options) {
  if (options.user.empty()) {
    return misuse("--user is empty; name whose hand it is, as in --user ann");
  }
  if (!options.live && !options.stream.empty()) return misuse("--stream also needs --connect");
  const bool timed = options.seconds > 0.0;
  if (!options.import.empty() &&
      (timed || options.brief || options.moves || !options.poses.empty())) {
    return misuse(
        "--import goes through no poses; leave out --seconds, --brief, --pose and --moves");
  }
  if (!timed && options.ready_given) {
    return misuse("--ready is the time between poses that begin by themselves; add --seconds");
  }
  return OutputFiles(options.overwrite)
      .reads(options.import)
      .writes_any_but_other(options.out, {".toml"})
      .check();
}

Result<> calibrate(const CalibrateOptions& options) {
  const Interrupt interrupt;
  TRY(check_options(options));
  auto file = TRY(options.import.empty() ? from_poses(options) : from_file(options));
  file.user = options.user;
  const std::string text = drivers::glove::format_calibration(file);
  TRY(write_whole_file(options.out, text));
  const std::string out = options.out.string();
  std::fprintf(stderr, "%zu sensors calibrated: %s\n", file.sensors.size(), out.c_str());
  if (options.live) {
    std::fprintf(stderr, "use it now:     posed ctl calibrate %s %s\n", options.stream.c_str(),
                 out.c_str());
  }
  std::fprintf(stderr, "use it always:  calibration = \"%s\" in the stream's table\n", out.c_str());
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
  command->add_option("--hand", options->hand, "right or left; with --connect the stream's")
      ->default_str("right")
      ->check(CLI::IsMember({"right", "left"}));
  command->add_option("--import", options->import, "Another program's calibration, no poses")
      ->type_name("FILE");
  command
      ->add_option("--seconds", options->seconds, "Hold each pose this long; it begins by itself")
      ->check(in_range(0.1, kMaxSeconds));
  auto* ready =
      command->add_option("--ready", options->ready_s, "With --seconds: the time from pose to pose")
          ->capture_default_str()
          ->check(in_range(0.0, kMaxSeconds));
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--force", options->force, "Write the calibration even if poses failed");
  command->add_flag("--brief", options->brief,
                    "The first four poses alone: quick, but the verdict stays doubtful");
  command->add_flag("--moves", options->moves,
                    "After the poses two moves, which take out what sensors show of each other");
  command->add_option("--pose", options->poses, "How long one pose is held; 0 leaves it out")
      ->type_name("POSE=SECONDS");
  command->add_option("--out", options->out, "The calibration to write")
      ->type_name("C.toml")
      ->required();
  command->footer(
      R"(Poses: flat, fist, thumb, spread fit the sensors. Contacts (touch-index, touch-middle,
touch-ring, touch-little, touch-fist) fit the thumb to what it touches and tell the fingers' sensors
apart. flat-again and spread-again, and the fingers of touch-fist, show how exactly you hold a pose.
All take about a minute; --brief asks for the first four only. On a terminal a screen shows what to
do; elsewhere a line on stdout names each pose and a line on stdin begins it, or --seconds does;
where stdin ends after the first four, the rest is left out (with --moves say --brief). A pose in
which the hand moved, whose sensors hardly moved from the flat hand, or that was another (half a
fist, fist and flat swapped, not the first time's), fails: the screen asks for it again, a script
gets exit code 1 and no file.
--moves is tried in simulation only, not on a real glove. Examples:
  posed calibrate --driver cyberglove --port /dev/ttyUSB0 --user ann --out ann.toml
  posed calibrate --connect tcp://127.0.0.1:5570 --stream right --user ann --out ann.toml
  posed calibrate --driver cyberglove --import old.cal --user ann --out ann.toml)");
  command->callback([options, connect, ready, &exit_code] {
    options->live = connect->count() > 0;
    options->ready_given = ready->count() > 0;
    exit_code = report(calibrate(*options));
  });
}

}  // namespace posed::tools
