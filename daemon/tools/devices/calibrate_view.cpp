#include "daemon/tools/devices/calibrate_view.hpp"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"

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
  const auto columns = static_cast<std::size_t>(width);
  if (name.size() <= columns) return name;
  return name.substr(0, columns - 3) + "~" + name.substr(name.size() - 2);
}

std::size_t place(Pose pose) { return static_cast<std::size_t>(pose); }

// "flat: done   [fist]   thumb   spread"
std::string steps(const CalibrateView& view) {
  std::string text;
  for (std::size_t i = 0; i < view.poses.size(); ++i) {
    const std::string name(kPoseNames[place(view.poses[i])]);
    if (!text.empty()) text += "   ";
    text += i == view.pose ? "[" + name + "]" : i < view.pose ? name + ": done" : name;
  }
  return text;
}

std::string what_to_do(const CalibrateView& view) {
  if (view.silent) return "Nothing comes from the glove: is it switched on and worn?";
  if (view.phase == PosePhase::kAsked && view.left_s <= 0.0) {
    const std::string back = view.pose > 0 ? "   b: back one pose" : "";
    return "Enter: I hold it" + back + "   q: give up";
  }
  constexpr int kSteps = 20;
  const int done = static_cast<int>(std::clamp(view.share, 0.0, 1.0) * kSteps);
  return fmt::format("{} [{:<{}}] {:.1f} s",
                     view.phase == PosePhase::kAsked ? "Get ready " : "Hold still",
                     std::string(static_cast<std::size_t>(done), '='), kSteps, view.left_s);
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
  std::vector<std::string> text(static_cast<std::size_t>(lines));
  for (int i = 0; i < std::min(count, lines * columns); ++i) {
    std::string& line = text[static_cast<std::size_t>(i % lines)];
    if (i >= lines) line += " ";
    line += cell(view, *there[static_cast<std::size_t>(i)], cell_width, name_width);
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
                                 paint(view.colour, kDim, cut(steps(view), width)), ""};
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
  const auto most = static_cast<std::size_t>(std::max(view.height, 1));
  if (lines.size() > most) lines.resize(most);
  return lines;
}

}  // namespace posed::tools
