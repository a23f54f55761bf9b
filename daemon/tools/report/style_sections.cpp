#include "daemon/tools/report/style_sections.hpp"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

constexpr double kPoseRow_px = 190.0;

}  // namespace

Figure cycle_strips(const CycleRows& cycles) {
  Figure figure{.title = cycles.title, .sentence = cycles.sentence, .drawings = {}, .tables = {}};
  for (const CycleRows::Seen& view : cycles.views) {
    const auto layout = picture::layout_of(cycles.rows, view.camera, kPoseRow_px, true);
    auto strip = picture::draw_strip(cycles.rows, view.camera, layout,
                                     {.title = "Seen " + view.from, .sentence = ""});
    figure.drawings.push_back({.width_px = strip.width_px,
                               .height_px = strip.height_px,
                               .elements = std::move(strip.elements),
                               .kind = "strip"});
  }
  return figure;
}

Figure joint_residuals(const std::string& what, const std::vector<JointResidual>& joints) {
  std::vector<JointResidual> sorted = joints;
  std::ranges::stable_sort(sorted, std::ranges::greater{}, &JointResidual::before_deg);
  Bars bars{.quantity = "distance from the target's mean cycle, rms over the stride",
            .unit = "deg",
            .series = {"before", "after styling"},
            .groups = {}};
  for (const JointResidual& joint : sorted) {
    bars.groups.push_back({joint.joint, {joint.before_deg, joint.after_deg}});
  }
  return {.title = "What is left, joint by joint: " + what,
          .sentence =
              "Joints that the style changes most stand on top; a short second bar says "
              "that styling brings the joint to the target, one as long as the first that "
              "it does not.",
          .drawings = {draw_bars(bars)},
          .tables = {}};
}

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
  constexpr std::size_t kMaxShownRows = 40;
  std::vector<HeldOutWalker> worst = walkers;
  std::ranges::stable_sort(worst, {}, &HeldOutWalker::closes);
  if (worst.size() > kMaxShownRows) worst.resize(kMaxShownRows);
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

namespace {

constexpr std::size_t kTies = 14;  // lines between poses of one phase

void include_path(const PosePaths::Path& path, Range& x, Range& y) {
  for (const Point& point : path.points) {
    x.add(point.x);
    y.add(point.y);
  }
}

std::string component(int place, double share) {
  return fmt::format("component {} of the input ({:.0f} % of its variance)", place, 100.0 * share);
}

void draw_path(const PosePaths::Path& path, std::size_t series, Plot& plot) {
  plot.line(path.name, series, path.points, true);
  if (!path.points.empty()) plot.marks({}, series, std::span(path.points).first(1));
}

}  // namespace

Figure pose_paths(const PosePaths& paths) {
  Range x;
  Range y;
  include_path(paths.input, x, y);
  include_path(paths.output, x, y);
  if (paths.goal) include_path(*paths.goal, x, y);
  Plot plot({component(1, paths.first_share), "deg", x},
            {component(2, paths.second_share), "deg", y}, {.height_px = 440.0});
  plot.make_scales_equal();
  const std::size_t count = std::min(paths.input.points.size(), paths.output.points.size());
  const std::size_t step = std::max<std::size_t>(1, count / kTies);
  for (std::size_t i = 0; i < count; i += step) {
    plot.tie(paths.input.points[i], paths.output.points[i]);
  }
  draw_path(paths.input, 0, plot);
  draw_path(paths.output, 1, plot);
  if (paths.goal) draw_path(*paths.goal, 2, plot);
  return {.title = "Paths of the poses over one stride: " + paths.what,
          .sentence =
              "Thin lines join the pose before and after styling at one phase; as their lengths "
              "and directions change along the stride, the style is no constant offset. The mark "
              "on each path is phase 0, the right thigh farthest in front.",
          .drawings = {plot.drawing()},
          .tables = {}};
}

Figure stride_scores(const std::vector<ClipStride>& clips, double warn, double refuse) {
  constexpr std::size_t kMaxClips = 40;
  std::vector<ClipStride> worst = clips;
  std::ranges::stable_sort(worst, std::ranges::greater{}, &ClipStride::score);
  if (worst.size() > kMaxClips) worst.resize(kMaxClips);
  Bars bars{.quantity = "stride score: share of the legs' motion that fits no stride",
            .unit = "1",
            .series = {"score"},
            .groups = {},
            .rules = {{warn, "uneven: warns"}, {refuse, "no walk: refuses"}},
            .logarithmic = false,
            .digits = 3};
  Table table{.columns = {{"clip", false},
                          {"group", false},
                          {"frames"},
                          {"stride [s]"},
                          {"stride score [1]"},
                          {"from its own cycle, rms [deg]"}},
              .rows = {}};
  for (const ClipStride& clip : worst) {
    bars.groups.push_back({clip.clip, {clip.score}});
    table.rows.push_back({clip.clip, clip.group, std::to_string(clip.frames),
                          number_text(clip.period_s, 2), number_text(clip.score, 3),
                          number_text(clip.residual_deg, 1)});
  }
  std::string sentence =
      "Short bars are steady walks; a bar beyond the first line has uneven strides, one beyond the "
      "second is no walk at all, and its phases are a guess.";
  if (clips.size() > worst.size()) {
    sentence += fmt::format(" Shown are the {} worst of {}.", worst.size(), clips.size());
  }
  return {.title = "Strides of the clips",
          .sentence = std::move(sentence),
          .drawings = {draw_bars(bars)},
          .tables = {std::move(table)}};
}

namespace {

constexpr double kMapRoom = 0.12;  // around the marks, of their extent

Axis map_axis(const std::string& what, const std::string& unit, int place, double share,
              Range range) {
  const double room = kMapRoom * (range.high - range.low);
  range.add(range.low - room);
  range.add(range.high + room);
  return {fmt::format("{}, component {} ({:.0f} %)", what, place, 100.0 * share), unit, range};
}

}  // namespace

Figure style_map(const StyleMap& map) {
  std::vector<std::string> groups;
  Range x;
  Range y;
  for (const StyleMark& mark : map.marks) {
    x.add(mark.x);
    y.add(mark.y);
    if (std::ranges::find(groups, mark.group) == groups.end()) groups.push_back(mark.group);
  }
  Plot plot(map_axis(map.of_axis, map.unit, 1, map.first_share, x),
            map_axis(map.of_axis, map.unit, 2, map.second_share, y), {.height_px = 420.0});
  plot.make_scales_equal();  // distances have a meaning, and two marks are no noise made large
  for (std::size_t g = 0; g < groups.size(); ++g) {
    std::vector<Point> points;
    for (const StyleMark& mark : map.marks) {
      if (mark.group == groups[g]) points.push_back({mark.x, mark.y});
    }
    plot.marks(clean_name(groups[g]), g, points);
  }
  std::vector<Point> points;
  std::vector<std::string> names;
  for (const StyleMark& mark : map.marks) {
    points.push_back({mark.x, mark.y});
    names.push_back(clean_name(mark.name));
  }
  std::string unnamed;
  if (const int homeless = plot.name_points(points, names); homeless > 0) {
    unnamed = fmt::format(" {} of {} marks stand too close to others for a name.", homeless,
                          map.marks.size());
  }
  return {.title = "Where the styles lie: " + map.what,
          .sentence =
              "Each mark is one person in one style: where the groups form islands, the "
              "styles can be told apart; where they mix, there is little to learn. The axes are "
              "the two "
              "directions of the largest variance, with their shares of it. " +
              map.explanation + unnamed,
          .drawings = {plot.drawing()},
          .tables = {}};
}

}  // namespace posed::report
