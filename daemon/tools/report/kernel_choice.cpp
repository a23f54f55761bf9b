#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/style_sections.hpp"

namespace posed::report {
namespace {

bool same(double a, double b) { return std::abs(a - b) <= 1e-9 * std::max(std::abs(a), 1e-9); }

}  // namespace

Figure kernel_choice(const std::vector<TriedLength>& tried, double chosen_deg,
                     double chosen_noise) {
  std::vector<double> noises;
  Range length;
  Range error;
  for (const TriedLength& one : tried) {
    if (std::ranges::find(noises, one.noise) == noises.end()) noises.push_back(one.noise);
    length.add(one.length_deg);
    error.add(one.error_deg);
  }
  const double room = 0.08 * (error.high - error.low);
  error.add(error.low - room);
  error.add(error.high + room);
  std::ranges::sort(noises);
  Plot plot({"length of the kernel", "deg", length},
            {"error of a held-out frame, rms over joints", "deg", error}, {.height_px = 320.0});
  for (std::size_t n = 0; n < noises.size(); ++n) {
    std::vector<Point> points;
    for (const TriedLength& one : tried) {
      if (one.noise == noises[n]) points.push_back({one.length_deg, one.error_deg});
    }
    std::ranges::sort(points, {}, &Point::x);
    const std::string name = fmt::format("noise over signal {:g}", noises[n]);
    plot.line(name, n, points);
    plot.marks({}, n, points);
  }
  for (const TriedLength& one : tried) {
    if (same(one.length_deg, chosen_deg) && one.noise == chosen_noise) {
      plot.word({one.length_deg, one.error_deg}, "chosen");
    }
  }
  return {.title = "Choice of the kernel",
          .sentence =
              "Each point is a kernel, judged by walkers that it did not learn from; the lowest "
              "one was chosen. A flat valley says that the choice matters little.",
          .drawings = {plot.drawing()},
          .tables = {}};
}

Figure held_out_walkers(const std::vector<HeldOutWalker>& walkers) {
  constexpr std::size_t kMostRows = 40;
  std::vector<HeldOutWalker> worst = walkers;
  std::ranges::stable_sort(worst, {}, &HeldOutWalker::closes);
  if (worst.size() > kMostRows) worst.resize(kMostRows);
  Table table{.columns = {{"held-out clip", false},
                          {"person", false},
                          {"takes left out"},
                          {"closed of the way [%]"},
                          {"by a constant [%]"}},
              .rows = {}};
  for (const HeldOutWalker& walker : worst) {
    table.rows.push_back({walker.clip, walker.person, std::to_string(walker.left_out),
                          number_text(100.0 * walker.closes, 1),
                          number_text(100.0 * walker.constant_closes, 1)});
  }
  std::string sentence =
      "Each row is a walker that the model did not learn from: 100 % would reach the target's own "
      "cycle, 0 % is no help. The worst stand first; where a constant closes more, the process "
      "learnt nothing about the pose.";
  if (walkers.size() > worst.size()) {
    sentence += fmt::format(" Shown are {} of {}.", worst.size(), walkers.size());
  }
  return {.title = "Walkers left out, one after the other",
          .sentence = std::move(sentence),
          .drawings = {},
          .tables = {std::move(table)}};
}

}  // namespace posed::report
