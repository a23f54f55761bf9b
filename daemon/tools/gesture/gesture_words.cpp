#include "daemon/tools/gesture/gesture_words.hpp"

#include <cstdio>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace posed::tools {
namespace {

using nlohmann::json;

// "held poses are 2.1 deg from the recorded ones (a constant pose 30.2, ...)"
std::string hold_words(const json& holds) {
  std::string text =
      fmt::format("held poses are {:.1f} deg from the recorded ones", holds["deg"].get<double>());
  if (!holds.contains("constant_deg")) return text;
  return text + fmt::format(" (the nearest pose learnt from {:.1f}, a constant pose {:.1f})",
                            holds["nearest_recorded_deg"].get<double>(),
                            holds["constant_deg"].get<double>());
}

void print_figures(const char* what, const json& figures) {
  std::printf("%-10s", what);
  for (const auto& [name, value] : figures.items()) {
    if (value.is_number()) std::printf("  %s %.4g", name.c_str(), value.get<double>());
  }
  std::printf("\n");
}

// A line of the held poses' table.
void print_hold(const std::string& name, const json& figures) {
  std::printf("%-16s", name.c_str());
  for (const char* of : {"deg", "nearest_recorded_deg", "constant_deg", "best_composition_deg"}) {
    if (figures.contains(of)) std::printf(" %10.2f", figures[of].get<double>());
  }
  std::printf("\n");
}

void print_holds(const json& holds) {
  std::printf("held poses, deg rms from the recorded ones%s:\n%-16s %10s",
              holds.contains("constant_deg") ? ", and without a model" : "", "", "performed");
  if (holds.contains("constant_deg")) {
    std::printf(" %10s %10s %10s", "nearest", "constant", "composed");
  }
  std::printf("\n");
  for (const json& label : holds["labels"]) {
    const bool recorded = label["recorded"].get<bool>();
    print_hold(label["label"].get<std::string>() + (recorded ? "" : " (new)"), label);
    for (const auto& [group, figures] : label["groups"].items()) {
      print_hold("  " + group, figures);
    }
  }
  std::printf("\n");
}

}  // namespace

bool gesture_is_good(const json& report) {
  if (report.contains("min_gap_cm")) return report["min_gap_cm"].get<double>() >= 0.0;
  if (!report.contains("holds") || !report["holds"].contains("constant_deg")) return true;
  return report["holds"]["deg"].get<double>() < report["holds"]["constant_deg"].get<double>();
}

std::string gesture_verdict(const json& report) {
  const bool hand = report.contains("min_gap_cm");
  std::vector<std::string> parts;
  if (hand) {
    parts.emplace_back(gesture_is_good(report) ? "fingers never overlap" : "fingers overlap");
  }
  if (report.contains("holds")) parts.push_back(hold_words(report["holds"]));
  if (report.contains("reference")) {
    const json& reference = report["reference"];
    parts.push_back(
        fmt::format("the motion is {:.1f} deg (rms of an angle) from the nearest recorded pose and "
                    "{:.2f} times as rough as the recording",
                    reference["nearest_reference_deg"].get<double>(),
                    report["performed"]["jerk"].get<double>() / reference["jerk"].get<double>()));
  } else {
    parts.push_back(fmt::format("--reference RECORDING shows how close it is to a real {}",
                                hand ? "hand" : "body"));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

void print_gesture_report(const json& report) {
  print_figures("performed", report["performed"]);
  if (report.contains("reference")) print_figures("reference", report["reference"]);
  if (report.contains("min_gap_cm")) {
    std::printf("fingers    %.3f cm apart at least, %.3f before the constraints\n",
                report["min_gap_cm"].get<double>(), report["min_gap_before_cm"].get<double>());
  }
  if (report.contains("feet_off_cm")) {
    std::printf("feet       within %.2f cm of their places\n", report["feet_off_cm"].get<double>());
  }
  const json& leaves = report["leaves"];
  std::printf("leaves     %d in %zu trees\n\n", leaves["total"].get<int>(),
              leaves["states"].size() * leaves["states"].front().size());
  if (report.contains("holds")) print_holds(report["holds"]);
  std::printf("error of an angle at a look-ahead of so many frames:\n");
  std::printf("%10s %10s %10s %10s\n", "look-ahead", "rms deg", "max deg", "jerk ratio");
  for (const json& point : report["curve"]) {
    std::printf("%10d %10.4f %10.4f %10.3f\n", point["lookahead"].get<int>(),
                point["channel_rms_deg"].get<double>(), point["channel_max_deg"].get<double>(),
                point["jerk_ratio"].get<double>());
  }
}

}  // namespace posed::tools
