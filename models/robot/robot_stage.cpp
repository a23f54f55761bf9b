#include "models/robot/robot_stage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "models/parameter_table.hpp"
#include "models/robot/command.hpp"
#include "models/robot/hand_target.hpp"
#include "models/robot/pose_solver.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::robot {
namespace {

constexpr double kUnknownRate_hz = 60.0;
constexpr double kSilent_s = 0.2;
constexpr std::int64_t kJumpsBack_ns = kNanosPerSecond;
constexpr std::int64_t kToldEvery_ns = kNanosPerSecond;
constexpr std::int64_t kShownFor_ns = 2 * kNanosPerSecond;  // stats are told once a second
constexpr std::int64_t kMaxTime_ns = std::numeric_limits<std::int64_t>::max() / 2;
constexpr double kMaxFingerAngle_rad = 7.0;  // beyond a turn no finger's angle is one
constexpr int kRounds = 2;
constexpr std::array<std::string_view, 3> kSides{"hand", "left", "right"};

enum class RobotSide : std::uint8_t { kHand, kLeft, kRight };
enum Reading : std::size_t { kLimited, kStops, kHardStops, kHolds, kStopJoint, kStopOther };
enum Notice : std::size_t {
  kSilent,
  kDistrusted,
  kTimeJump,
  kHardStop,
  kStop,
  kSlower,
  kSeveral,
  kUnlimited,
  kAssumed,
  kNotices
};

struct StageOptions {
  std::string urdf, tips, hold, start;
  RobotSide side = RobotSide::kHand;
  double speed = 0.0;
  double acceleration = 120.0;
  double margin_mm = 1.0;
  double rate_hz = 0.0;
};

class RobotStage final : public Stage {
 public:
  using Table = ParameterTable<StageOptions, RobotStage>;
  static const Table& table();

  RobotStage(RobotHand robot, Skeleton skeleton, const StageContext& context,
             const StageOptions& options);

  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  RT_SAFE void tick(std::int64_t now_ns, StageOut& out) noexcept override;
  [[nodiscard]] bool command(std::size_t index, const StageCommand& command) noexcept override;
  [[nodiscard]] std::optional<StageNotice> take_notice() noexcept override;
  [[nodiscard]] double reading(std::size_t reading) const noexcept override;

 private:
  RT_SAFE double elapsed_s(std::int64_t now_ns) noexcept;
  RT_SAFE bool trusts(const Frame& frame, HandAngles& angles) const noexcept;
  RT_SAFE void hold(double dt_s, Notice why) noexcept;
  RT_SAFE void follow(double dt_s) noexcept;
  RT_SAFE void find_stops() noexcept;
  RT_SAFE void emit(const Frame& like, StageOut& out) noexcept;
  RT_SAFE void tell(Notice notice) noexcept;

  RobotHand robot_;
  Skeleton skeleton_;
  std::shared_ptr<const Skeleton> hand_;
  HandTargets targets_;
  PoseSolver solver_;
  Command command_;
  HandTarget target_{};
  Frame last_{};  // the latest of the hand, for ticks
  std::int64_t period_ns_, silent_ns_;
  bool ticks_;                            // between the frames, too
  std::int64_t time_ns_ = kNoTime_ns;     // of the latest command
  std::int64_t arrival_ns_ = kNoTime_ns;  // of the latest frame
  bool engaged_ = false;                  // somebody wants it
  bool follows_ = false;                  // and the hand is trusted
  bool rests_ = true;                     // so said the latest frame
  RobotState told_ = RobotState::kReleased;
  std::uint64_t hard_stops_ = 0, holds_ = 0;
  std::int64_t stopped_ns_ = kNoTime_ns;  // when links were last in the way of it
  std::pair<int, int> stopped_by_{-1, -1};
  std::array<bool, kNotices> notice_{};
  std::array<std::int64_t, kNotices> told_ns_{};
};

const RobotStage::Table& RobotStage::table() {
  static const Table table({
      Table::row<&StageOptions::urdf>(
          {.name = "urdf", .required = true, .is_path = true, .help = "the robot hand (.urdf)"}),
      Table::row<&StageOptions::side>({.name = "side",
                                       .help = "which hand the robot is, of several the driven "
                                               "one; hand: as the one that drives it",
                                       .words = kSides}),
      Table::row<&StageOptions::tips>(
          {.name = "tips",
           .help = "last links of the fingers, thumb first: \"t, i, m, r, l\"; empty: derived"}),
      Table::row<&StageOptions::hold>({.name = "hold",
                                       .help = "joints that stand, \"wrist=0.1\", rad; an arm's "
                                               "and a wrist's have commands only if "
                                               "they are here"}),
      Table::row<&StageOptions::speed>(
          {.name = "speed",
           .help = "of each joint, rad/s, 0: 8; or what the URDF says where that is less",
           .min = 0.0,
           .max = 100.0}),
      Table::row<&StageOptions::acceleration>(
          {.name = "acceleration", .help = "of each joint, rad/s^2", .min = 1.0, .max = 10000.0}),
      Table::row<&StageOptions::margin_mm>({.name = "margin_mm",
                                            .help = "how far the robot's links stay apart",
                                            .min = 0.1,
                                            .max = 20.0}),
      Table::row<&StageOptions::rate_hz>(
          {.name = "rate_hz",
           .help = "commands a second, also between the hand's frames; 0: one a frame",
           .min = 0.0,
           .max = 1000.0}),
      Table::row<&StageOptions::start>(
          {.name = "start", .help = "the first command: \"joint=0.5\", rad; others are at zero"}),
  });
  return table;
}

double rate_of(const StageContext& context, const StageOptions& options) {
  if (options.rate_hz > 0.0) return options.rate_hz;
  return context.rate_hz > 0.0 ? context.rate_hz : kUnknownRate_hz;
}

RobotStage::RobotStage(RobotHand robot, Skeleton skeleton, const StageContext& context,
                       const StageOptions& options)
    : robot_(std::move(robot)),
      skeleton_(std::move(skeleton)),
      hand_(context.skeleton),
      targets_(robot_, hand::hand_geometry(hand::shape_of(*hand_))),
      solver_(robot_, 1e-3 * options.margin_mm),
      command_(robot_, 1e-3 * options.margin_mm),
      period_ns_(static_cast<std::int64_t>(1e9 / rate_of(context, options))),
      silent_ns_(std::max(static_cast<std::int64_t>(kSilent_s * 1e9),
                          context.rate_hz > 0.0 ? static_cast<std::int64_t>(3e9 / context.rate_hz)
                                                : std::int64_t{0})),
      ticks_(options.rate_hz > 0.0) {
  notice_[kSlower] = std::ranges::any_of(robot_.joints, [&](const RobotJoint& joint) {
    return joint.driven >= 0 && joint.speed < options.speed;
  });
  notice_[kSeveral] = !robot_.chosen.empty();
  notice_[kAssumed] = !robot_.remarks.empty();
  notice_[kUnlimited] = std::ranges::any_of(
      robot_.links, [](const Link& link) { return link.unlimited && link.leader < 0; });
}

// Since the command before, at most two periods: a stall authorises no jump. A step back in time is
// waited out, unless it is long.
RT_SAFE double RobotStage::elapsed_s(std::int64_t now_ns) noexcept {
  if (time_ns_ == kNoTime_ns) {
    time_ns_ = now_ns;
    return 0.0;
  }
  if (now_ns <= time_ns_) {
    const auto back_ns = static_cast<std::uint64_t>(time_ns_) - static_cast<std::uint64_t>(now_ns);
    if (back_ns > static_cast<std::uint64_t>(kJumpsBack_ns)) time_ns_ = now_ns;
    return 0.0;
  }
  const auto gap_ns = static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(time_ns_);
  time_ns_ = now_ns;
  return 1e-9 * static_cast<double>(std::min(gap_ns, static_cast<std::uint64_t>(2 * period_ns_)));
}

RT_SAFE bool RobotStage::trusts(const Frame& frame, HandAngles& angles) const noexcept {
  if (frame.skeleton != hand_->id || frame.quality == Quality::kStale) return false;
  if (frame.angle_count != kHandChannels) return false;
  for (std::size_t j = 0; j < hand_->joints.size(); ++j) {
    if (!frame.valid[j]) return false;
  }
  angles = hand_angles(frame);
  return std::ranges::all_of(angles, [](double angle) {
    return std::isfinite(angle) && std::abs(angle) <= kMaxFingerAngle_rad;
  });
}

RT_SAFE void RobotStage::tell(Notice notice) noexcept {
  if (told_ns_[notice] != 0 && time_ns_ - told_ns_[notice] < kToldEvery_ns &&
      time_ns_ >= told_ns_[notice]) {
    return;
  }
  told_ns_[notice] = time_ns_;
  notice_[notice] = true;
}

RT_SAFE void RobotStage::hold(double dt_s, Notice why) noexcept {
  if (follows_) {
    tell(why);
    ++holds_;
  }
  follows_ = false;
  command_.brake(dt_s);
}

RT_SAFE void RobotStage::follow(double dt_s) noexcept {
  if (!follows_ || command_.blocked()) solver_.restart(command_.pose());
  follows_ = true;
  command_.follow(solver_.solve(target_, kRounds), dt_s);
}

RT_SAFE void RobotStage::process(const StageFrame& in, StageOut& out) noexcept {
  // A frame that waited in a queue is older than the latest tick, but not than the frame before it.
  const std::int64_t now_ns = in.frame.header.arrival_ns;
  const bool sane = now_ns >= 0 && now_ns <= kMaxTime_ns;
  const bool jumped = !sane || now_ns < arrival_ns_;
  last_ = in.frame;
  if (sane) arrival_ns_ = now_ns;
  const double dt_s = sane ? elapsed_s(now_ns) : 0.0;
  HandAngles angles{};
  const bool trusted = trusts(in.frame, angles);
  if (!engaged_) {
    follows_ = false;
    command_.brake(dt_s);
  } else if (jumped) {
    hold(dt_s, kTimeJump);
  } else if (!trusted) {
    hold(dt_s, kDistrusted);
  } else {
    targets_.find(angles, target_);
    follow(dt_s);
  }
  emit(in.frame, out);
}

std::int64_t RobotStage::next_due_ns() const noexcept {
  if (arrival_ns_ == kNoTime_ns || time_ns_ == kNoTime_ns) return kNoTime_ns;
  const bool owed = !engaged_ && told_ != RobotState::kReleased;  // to say that it is released
  if (!follows_) return owed || !command_.stands() ? time_ns_ + period_ns_ : kNoTime_ns;
  const std::int64_t silent_ns = arrival_ns_ + silent_ns_;
  return ticks_ ? std::min(time_ns_ + period_ns_, silent_ns) : silent_ns;
}

RT_SAFE void RobotStage::tick(std::int64_t now_ns, StageOut& out) noexcept {
  const double dt_s = elapsed_s(now_ns);
  if (engaged_ && follows_ && now_ns - arrival_ns_ < silent_ns_) {
    follow(dt_s);
    last_.quality = Quality::kPredicted;
  } else {
    hold(dt_s, kSilent);
    last_.quality = Quality::kHeld;
  }
  Header& header = last_.header;
  if (header.device_ns != kNoTime_ns && header.arrival_ns != kNoTime_ns) {
    header.device_ns += now_ns - header.arrival_ns;
  }
  header.arrival_ns = now_ns;
  emit(last_, out);
}

RT_SAFE void RobotStage::find_stops() noexcept {
  const bool hard = command_.hard_stops() != hard_stops_;
  const bool stopped = command_.blocked();
  hard_stops_ = command_.hard_stops();
  if (hard) tell(kHardStop);
  if (stopped) tell(kStop);
  if (!hard && !stopped) return;
  stopped_ns_ = time_ns_;
  stopped_by_ = command_.in_the_way();
}

RT_SAFE void RobotStage::emit(const Frame& like, StageOut& out) noexcept {
  std::array<double, kMaxRobotJoints> values{};
  const std::size_t count = robot_.joints.size();
  for (std::size_t j = 0; j < count; ++j) values[j] = angle_of(robot_.joints[j], command_.pose());
  Frame frame;
  copy_all_but_pose(like, frame);
  pose_from_channels(skeleton_, {values.data(), count}, frame);
  for (std::size_t j = 0; j < count; ++j) {
    const RobotJoint& joint = robot_.joints[j];
    if (joint.driven < 0) continue;
    frame.velocity_rad_s[j] =
        static_cast<float>(joint.multiplier * command_.velocity()[joint.driven]);
  }
  // The command at rest is still one: who gets commands alone must not keep the last speed.
  frame.robot = follows_              ? RobotState::kEngaged
                : engaged_ || !rests_ ? RobotState::kHolding
                                      : RobotState::kReleased;
  rests_ = command_.stands();
  told_ = frame.robot;
  find_stops();
  out.frame({.frame = frame});
}

// An engagement stays owed until the hand is trusted; nothing moves before.
bool RobotStage::command(std::size_t index, const StageCommand& /*command*/) noexcept {
  engaged_ = index == kEngage;
  if (!engaged_) follows_ = false;
  return true;
}

std::optional<StageNotice> RobotStage::take_notice() noexcept {
  const auto at = std::ranges::find(notice_, true);
  if (at == notice_.end()) return std::nullopt;
  *at = false;
  return StageNotice{.index = static_cast<std::size_t>(at - notice_.begin())};
}

double RobotStage::reading(std::size_t reading) const noexcept {
  if (reading == kLimited) return static_cast<double>(command_.limited());
  if (reading == kStops) return static_cast<double>(command_.stops());
  if (reading == kHardStops) return static_cast<double>(command_.hard_stops());
  if (reading == kHolds) return static_cast<double>(holds_);
  const int link = reading == kStopJoint ? stopped_by_.first : stopped_by_.second;
  const bool lately = stopped_ns_ != kNoTime_ns && time_ns_ - stopped_ns_ < kShownFor_ns;
  return lately && link >= 0 ? link : std::numeric_limits<double>::quiet_NaN();
}

Result<RobotHand> robot_of(const StageContext& context) {
  const auto side = hand_side(*context.skeleton);
  if (!side) {
    return misuse("only hands (hand45) drive a robot hand; leave out its [stream.robot] table");
  }
  const StageOptions options = RobotStage::table().options(context.parameters);
  const Side robot = options.side == RobotSide::kHand   ? *side
                     : options.side == RobotSide::kLeft ? Side::kLeft
                                                        : Side::kRight;
  auto urdf = TRY(parse_urdf(options.urdf, "the URDF of [stream.robot]"));
  return robot_hand(std::move(urdf),
                    {.tips = options.tips,
                     .hold = options.hold,
                     .start = options.start,
                     .speed = options.speed,
                     .acceleration = options.acceleration,
                     .side = robot},
                    "the URDF of [stream.robot]");
}

Result<std::shared_ptr<const Skeleton>> leaves(const StageContext& context) {
  const auto robot = TRY(robot_of(context));
  auto skeleton = TRY(robot_skeleton(robot));
  return std::make_shared<const Skeleton>(std::move(skeleton));
}

Result<std::unique_ptr<Stage>> make_stage(const StageContext& context,
                                          const StageModel* /*model*/) {
  auto robot = TRY(robot_of(context));
  auto skeleton = TRY(robot_skeleton(robot));
  return std::make_unique<RobotStage>(std::move(robot), std::move(skeleton), context,
                                      RobotStage::table().options(context.parameters));
}

// The log keeps the text, so that a replay needs no file.
Result<> read_urdf(Parameters& parameters) {
  auto& urdf = std::get<std::string>(parameters.at("urdf"));
  urdf = TRY(load_urdf(urdf));
  return {};
}

Result<StageCommand> no_words(const StageModel* /*model*/, std::span<const std::string> words,
                              const Parameters& /*options*/) {
  if (!words.empty()) return misuse("this command takes no words");
  return StageCommand{};
}

}  // namespace

const StageType& robot_type() {
  static const StageType type{
      .name = "robot",
      .summary = "lets the hand drive a robot hand, within its limits",
      .parameters = RobotStage::table().specs(),
      .input = StageInput::kLoses,
      .read_files = read_urdf,
      .leaves = leaves,
      .make = make_stage,
      .readings = {{.name = "robot_limited", .help = "commands that links in the way changed"},
                   {.name = "robot_stops", .help = "times it stood because of them"},
                   {.name = "robot_hard_stops", .help = "commands beyond the acceleration"},
                   {.name = "robot_holds", .help = "times it braked because of the hand"},
                   {.name = "robot_stop_joint", .help = "that stopped it", .of_leaving = true},
                   {.name = "robot_stop_other", .help = "and that one", .of_leaving = true}},
      .notices = {{.sentence = "no frame of the hand comes: the robot brakes and holds"},
                  {.sentence = "the hand cannot be trusted: the robot brakes and holds"},
                  {.sentence = "the hand's time went back: the robot holds"},
                  {.sentence = "the robot was stopped at once, because links would have met"},
                  {.sentence = "links are in the way: the robot stands short of the hand"},
                  {.sentence = "`speed` is more than the URDF allows some joints: its limits hold "
                               "for them"},
                  {.sentence =
                       "the robot is more than a hand: the hand of `side` follows, all else "
                       "has no commands (`posed inspect` lists the hands)"},
                  {.sentence = "the URDF gives joints neither lower nor upper limit, so that they "
                               "stand at 0 (`posed inspect` names them)"},
                  {.sentence = "the URDF leaves open what some of the robot is: `posed inspect` "
                               "says how it is taken"}},
      .commands = {{.name = "engage",
                    .help = "the robot follows the hand, from where it is",
                    .encode = no_words},
                   {.name = "release",
                    .help = "the robot brakes, stands, and its frames are no commands",
                    .encode = no_words}}};
  return type;
}

}  // namespace posed::robot
