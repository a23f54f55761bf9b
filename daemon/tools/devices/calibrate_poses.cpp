#include "daemon/tools/devices/calibrate_poses.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/picture/braille.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::tools {
namespace {

using drivers::glove::kPoseHints;
using drivers::glove::kPoseNames;
using drivers::glove::Pose;

constexpr int kMinColumns = 40;
// smallest width of a sensor's cell; in a smaller one the bar's movement is not visible
constexpr int kCellWidth = 26;
constexpr int kMaxCell = 60;
constexpr int kValueWidth = 6;
constexpr int kBesideBar = kValueWidth + 5;  // blank, frame, value, mark
constexpr int kMinBar = 5;

// Shortens a name in its middle, because sensor names differ at their beginning and end:
// "thumb_jo~t1".
std::string squeezed(const std::string& name, int width) {
  const std::size_t columns = width;
  if (name.size() <= columns) return name;
  return name.substr(0, columns - 3) + "~" + name.substr(name.size() - 2);
}

std::size_t place(Pose pose) { return static_cast<std::size_t>(pose); }

// "flat: done   [fist]   thumb   spread"; where all have no room, later ones with the current
// first.
std::string steps(const CalibrateView& view, int width) {
  std::string text;
  std::size_t room = 0;  // up to the current pose
  for (std::size_t i = 0; i < view.poses.size(); ++i) {
    const std::string name(kPoseNames[place(view.poses[i])]);
    if (!text.empty()) text += "   ";
    text += i == view.pose ? "[" + name + "]" : i < view.pose ? name + ": done" : name;
    if (i == view.pose) room = text.size();
  }
  const auto columns = static_cast<std::size_t>(width);
  return room > columns ? text.substr(text.find('[')) : text;
}

std::string what_to_do(const CalibrateView& view) {
  if (view.silent) return "Nothing comes from the glove: is it switched on and worn?";
  if (view.phase == PosePhase::kAsked && view.left_s <= 0.0) {
    const std::string back = view.pose > 0 ? "   b: back" : "";
    return "Enter: I hold it" + back + (view.may_skip ? "   s: skip the rest" : "") +
           "   q: give up";
  }
  constexpr int kSteps = 20;
  const int done = static_cast<int>(std::clamp(view.share, 0.0, 1.0) * kSteps);
  return fmt::format("{} [{:<{}}] {:.1f} s",
                     view.phase == PosePhase::kAsked ? "Get ready " : "Hold still",
                     std::string(done, '='), kSteps, view.left_s);
}

std::string cell(const CalibrateView& view, const SensorView& sensor, int width, int name_width) {
  const int bar = width - name_width - kBesideBar;
  const bool still = view.any_held && sensor.still();
  std::string text = fmt::format("{:<{}} |{}|{:>{}.0f}", squeezed(sensor.name, name_width),
                                 name_width, sensor_bar(sensor, bar), sensor.value, kValueWidth);
  text += still ? " !" : "  ";
  return still ? paint(view.colour, kYellow, text) : text;
}

// The sensors as a table of `rows` lines, filled column by column.
std::vector<std::string> table(const CalibrateView& view, int width, int rows) {
  std::vector<const SensorView*> there;
  for (const SensorView& sensor : view.sensors) {
    if (sensor.there) there.push_back(&sensor);
  }
  if (there.empty()) return {"waiting for the first values ..."};
  const int count = static_cast<int>(there.size());
  const int most_columns = std::max(1, (width + 1) / (kCellWidth + 1));
  const int columns = std::clamp((count + rows - 1) / std::max(rows, 1), 1, most_columns);
  const int lines = std::min((count + columns - 1) / columns, std::max(rows, 1));
  const int cell_width = std::min((width - (columns - 1)) / columns, kMaxCell);
  int name_width = 0;
  for (const SensorView* sensor : there) {
    name_width = std::max(name_width, static_cast<int>(sensor->name.size()));
  }
  name_width = std::min(name_width, cell_width - kBesideBar - kMinBar);
  std::vector<std::string> text(lines);
  for (int i = 0; i < std::min(count, lines * columns); ++i) {
    std::string& line = text[i % lines];
    if (i >= lines) line += " ";
    line += cell(view, *there[i], cell_width, name_width);
  }
  if (count > lines * columns) {
    text.back() =
        fmt::format("... and {} more: make the window larger", count - (lines - 1) * columns);
  }
  return text;
}

}  // namespace

std::string sensor_bar(const SensorView& sensor, int width) {
  const double range = std::max(sensor.most - sensor.least, 1e-9);
  const auto at = [&](double value) {
    const double share = std::clamp((value - sensor.least) / range, 0.0, 1.0);
    return static_cast<int>(std::lround(share * std::max(width, 0)));
  };
  std::string bar;
  for (int i = 0; i < width; ++i) {
    const bool been = i >= at(sensor.low) && i < at(sensor.high);
    bar += i < at(sensor.value) ? '#' : been ? '-' : ' ';
  }
  return bar;
}

std::vector<std::string> calibrate_view(const CalibrateView& view) {
  const int width = std::max(view.width, kMinColumns);
  const Pose pose = view.poses[view.pose];
  std::vector<std::string> lines{paint(view.colour, kBold, cut(view.title, width)),
                                 paint(view.colour, kDim, cut(steps(view, width), width)), ""};
  std::string hint(kPoseHints[place(pose)]);
  hint[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(hint[0])));
  for (const std::string& line : wrapped(hint + ".", width)) {
    lines.push_back(paint(view.colour, kBold, line));
  }
  lines.push_back(paint(view.colour, view.silent ? kRed : kYellow, cut(what_to_do(view), width)));
  if (!view.note.empty()) lines.push_back(paint(view.colour, kRed, cut(view.note, width)));
  lines.push_back("");
  const int rows = view.height - static_cast<int>(lines.size()) - 1;
  for (std::string& line : table(view, width, rows)) lines.push_back(std::move(line));
  const std::string legend = view.any_held ? "# now   - where it has been   ! has not moved yet"
                                           : "# now   - where it has been";
  lines.push_back(paint(view.colour, kDim, cut(legend, width)));
  const std::size_t most = std::max(view.height, 1);
  if (lines.size() > most) lines.resize(most);
  return lines;
}

namespace {

using drivers::glove::Pose;
using drivers::glove::Recorded;
using SteadyClock = std::chrono::steady_clock;

constexpr double kRestlessShare = 0.12;  // share of a sensor's range; its noise is far less
constexpr double kPatience_s = 5.0;      // for a glove that sends nothing while the user reads

class Recording {
 public:
  Recording(GloveSource& source, const PosePlan& plan, PoseGuide& guide)
      : source_(source), plan_(plan), guide_(guide) {}

  Result<Recorded> run() {
    const std::vector<Pose> poses = plan_.poses();
    for (std::size_t i = 0; i < poses.size();) {
      const auto word = TRY(ask(poses[i]));
      if (word == PoseGuide::Word::kStop) return fail("stopped; no calibration was written");
      if (word == PoseGuide::Word::kEnough) break;
      if (word == PoseGuide::Word::kBack) {
        i -= i > 0 ? 1 : 0;
        continue;
      }
      TRY(hold(poses[i]));
      ++i;
    }
    return recorded_;
  }

 private:
  using Raw = GloveSource::Raw;
  using Valid = GloveSource::Valid;

  // Shows the live hand until the user confirms, or the time to get ready has passed.
  Result<PoseGuide::Word> ask(Pose pose) {
    guide_.want(pose);
    const double ready_s = plan_.ready_s.value_or(0.0);
    begin();
    PoseGuide::Word word = PoseGuide::Word::kNothing;
    const auto enough = [&] {
      word = guide_.receive();
      if (plan_.ready_s && word == PoseGuide::Word::kNothing && past_s() >= ready_s) {
        word = PoseGuide::Word::kGo;
      }
      return word != PoseGuide::Word::kNothing;
    };
    const auto show = [&](const Raw& raw, const Valid& valid) {
      guide_.show(raw, valid, PosePhase::kAsked, ready_s - past_s(), ready_s);
    };
    while (word == PoseGuide::Word::kNothing) {
      TRY(source_.listen(kPatience_s, show, enough));
    }
    return word;
  }

  Result<> hold(Pose pose) {
    auto& held = recorded_[static_cast<std::size_t>(pose)];
    held = {};
    begin();
    const double held_s = plan_.seconds[static_cast<std::size_t>(pose)];
    // shown to the user as one time in which to hold still
    const double whole_s = plan_.settle_s + held_s;
    const auto settle = [&](const Raw& raw, const Valid& valid) {
      guide_.show(raw, valid, PosePhase::kSettling, whole_s - past_s(), whole_s);
    };
    TRY(source_.listen(plan_.settle_s, settle));
    begin();
    std::array<std::optional<Span>, drivers::glove::kMaxSensors> spans{};
    const auto keep = [&](const Raw& raw, const Valid& valid) {
      for (std::size_t i = 0; i < raw.size(); ++i) {
        if (!valid[i]) continue;
        held[i].add(raw[i]);
        if (!spans[i]) spans[i] = Span{raw[i], raw[i]};
        spans[i]->low = std::min(spans[i]->low, raw[i]);
        spans[i]->high = std::max(spans[i]->high, raw[i]);
      }
      guide_.show(raw, valid, PosePhase::kHeld, held_s - past_s(), whole_s);
    };
    TRY(source_.listen(held_s, keep));
    const auto& sensors = source_.model().sensors;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (!spans[i] || !is_restless(*spans[i], sensors[i])) continue;
      guide_.restless(pose, sensors[i].name);
      break;
    }
    return {};
  }

  struct Span {
    float low, high;
  };
  static bool is_restless(const Span& span, const drivers::glove::Sensor& sensor) {
    const double range = sensor.raw_max - sensor.raw_min;
    return static_cast<double>(span.high - span.low) > kRestlessShare * range;
  }

  void begin() { begun_ = SteadyClock::now(); }
  [[nodiscard]] double past_s() const {
    return std::chrono::duration<double>(SteadyClock::now() - begun_).count();
  }

  GloveSource& source_;
  const PosePlan& plan_;
  PoseGuide& guide_;
  Recorded recorded_{};
  SteadyClock::time_point begun_{};  // start of the phase
};

}  // namespace

std::vector<Pose> PosePlan::poses() const {
  std::vector<Pose> poses;
  for (std::size_t p = 0; p < seconds.size(); ++p) {
    if (seconds[p] > 0.0) poses.push_back(static_cast<Pose>(p));
  }
  return poses;
}

void PosePlan::shorten() {
  std::fill(seconds.begin() + drivers::glove::kSensorPoses, seconds.end(), 0.0);
}

Result<Recorded> record_poses(GloveSource& source, const PosePlan& plan, PoseGuide& guide) {
  return Recording(source, plan, guide).run();
}

namespace {

using drivers::glove::Recorded;

constexpr int kGap = 2;              // blanks between the hands
constexpr int kMaxHandColumns = 18;  // of a hand
constexpr int kMinHandColumns = 12;

}  // namespace

std::vector<std::string> calibrated_hand(const drivers::glove::Model& model,
                                         const drivers::glove::Calibration& calibration, Side hand,
                                         const Recorded& recorded, int columns, int rows) {
  const auto skeleton = std::make_shared<const Skeleton>(hand_skeleton(hand));
  const picture::FigureShape shape(skeleton);
  const picture::Camera camera(picture::View::kThreeQuarter, shape.facing(0.0));
  const std::size_t at_most =
      static_cast<std::size_t>(std::max(1, (columns + kGap) / (kMinHandColumns + kGap)));
  std::vector<picture::StripRow> strips;
  for (std::size_t p = 0; p < drivers::glove::kPoses; ++p) {
    const bool again = p > static_cast<std::size_t>(Pose::kTouchFist);
    if (again || !drivers::glove::was_held(recorded[p])) continue;
    HandAngles angles = drivers::glove::angles_of(model, calibration, recorded[p]);
    for (double& angle_rad : angles) angle_rad = std::isfinite(angle_rad) ? angle_rad : 0.0;
    Frame frame;
    frame.skeleton = skeleton->id;
    frame.joint_count = static_cast<std::uint16_t>(skeleton->joints.size());
    set_hand_angles(*skeleton, angles, frame);
    if (strips.empty() || strips.back().poses.size() == at_most) strips.emplace_back();
    strips.back().poses.push_back(
        {.figure = shape.pose(frame), .caption = std::string(drivers::glove::kPoseNames[p])});
  }
  std::vector<std::string> lines;
  if (strips.empty() || rows < 2) return lines;
  const int hands = static_cast<int>(strips.front().poses.size());
  const int width = std::clamp((columns + kGap) / hands - kGap, 1, kMaxHandColumns);
  const picture::StripLayout room = picture::layout_of(strips, camera, 1.0, false);
  for (const picture::StripRow& strip : strips) {
    std::vector<std::string> beside(rows);
    for (const auto& [figure, caption] : strip.poses) {
      auto drawn = picture::braille(figure, camera, room, width, rows - 1);
      drawn.push_back(fmt::format("{:^{}.{}}", caption, width, width));
      for (std::size_t i = 0; i < beside.size(); ++i) {
        if (!beside[i].empty()) beside[i] += std::string(kGap, ' ');
        beside[i] += drawn[i];
      }
    }
    std::ranges::move(beside, std::back_inserter(lines));
  }
  return lines;
}

}  // namespace posed::tools
