#include "daemon/tools/report/gesture_sections.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

// One scale for all, so that they can be compared.
Range angles_of(const std::vector<AngleTrajectory>& trajectories) {
  Range range;
  for (const AngleTrajectory& angle : trajectories) {
    for (const auto* line : {&angle.recorded, &angle.low, &angle.high}) {
      for (const Point& point : *line) range.add(point.y);
    }
  }
  const double room = 0.12 * (range.high - range.low);
  range.add(range.high + room);  // for the labels' names
  return range;
}

}  // namespace

Figure angle_trajectories(const std::string& title, const std::string& sentence,
                          const std::string& angle,
                          const std::vector<AngleTrajectory>& trajectories,
                          const std::vector<LabelSpan>& labels) {
  Figure figure{.title = title, .sentence = sentence, .drawings = {}, .tables = {}};
  const Range angles = angles_of(trajectories);
  Range time;
  for (const LabelSpan& label : labels) {
    time.add(label.from_s);
    time.add(label.to_s);
  }
  for (const AngleTrajectory& shown : trajectories) {
    const bool first = figure.drawings.empty();  // only the first one needs the legend
    Plot plot({"time", "s", time}, {angle, "deg", angles}, {.width_px = 900.0, .height_px = 180.0});
    plot.headline(shown.name);
    plot.band(first ? "the model's band, two deviations on each side" : "", 1, shown.low,
              shown.high);
    plot.line(first ? "the model's most likely motion" : "", 1, shown.mean);
    if (!shown.recorded.empty()) plot.line(first ? "recorded" : "", 0, shown.recorded);
    for (const LabelSpan& label : labels) plot.rule_at_x(label.from_s, clean_name(label.label));
    figure.drawings.push_back(plot.drawing());
  }
  return figure;
}

namespace {

constexpr double kNodeHeight_px = 36.0, kRowGap_px = 8.0, kColumnGap_px = 40.0,
                 kTreeTitle_px = 26.0;
constexpr double kTreePad_px = 8.0;

class TreeDrawing {
 public:
  explicit TreeDrawing(const gesture::DrawnTree& tree)
      : tree_(tree), y_px_(tree.nodes.size(), 0.0), column_(tree.nodes.size(), 0) {
    if (tree.nodes.empty()) return;
    place(0, 0);
    x_px_.push_back(0.0);
    for (const double width : widths_) x_px_.push_back(x_px_.back() + width + kColumnGap_px);
  }

  [[nodiscard]] Drawing drawing() const {
    std::string out =
        fmt::format("<text x=\"0\" y=\"15\" font-weight=\"600\">{}</text>\n", escaped(tree_.title));
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) out += ways_of(i);
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) out += box_of(i);
    const double width = x_px_.empty() ? 0.0 : x_px_.back() - kColumnGap_px;
    return {.width_px = std::max(width, text_px(tree_.title)) + 2.0,
            .height_px = kTreeTitle_px + next_px_ + 4.0,
            .elements = std::move(out),
            .kind = "tree"};
  }

 private:
  // A node is in the middle of its leaves.
  double place(int node, std::size_t column) {
    const std::size_t at = node;
    const gesture::DrawnNode& here = tree_.nodes[at];
    if (column >= widths_.size()) widths_.resize(column + 1, 0.0);
    widths_[column] = std::max(
        widths_[column], std::max(text_px(here.words), text_px(here.reach)) + 2.0 * kTreePad_px);
    column_[at] = column;
    if (here.yes < 0) {
      y_px_[at] = next_px_;
      next_px_ += kNodeHeight_px + kRowGap_px;
    } else {
      const double first = place(here.yes, column + 1);
      const double last = place(here.no, column + 1);
      y_px_[at] = (first + last) / 2.0;
    }
    return y_px_[at];
  }

  [[nodiscard]] double middle_px(std::size_t node) const {
    return kTreeTitle_px + y_px_[node] + kNodeHeight_px / 2.0;
  }

  [[nodiscard]] std::string ways_of(std::size_t node) const {
    const gesture::DrawnNode& here = tree_.nodes[node];
    std::string out;
    if (here.yes < 0) return out;
    const double from = x_px_[column_[node]] + widths_[column_[node]];
    for (const bool yes : {true, false}) {
      const std::size_t child = yes ? here.yes : here.no;
      const double to = x_px_[column_[child]];
      const double bend = from + 12.0;
      out += fmt::format("<path class=\"way\" d=\"M{:.1f} {:.1f}H{:.1f}V{:.1f}H{:.1f}\"/>\n", from,
                         middle_px(node), bend, middle_px(child), to);
      out += fmt::format("<text class=\"quiet\"{}{}>{}</text>\n", svg_attribute("x", bend + 3.0),
                         svg_attribute("y", middle_px(child) + (yes ? -4.0 : 14.0)),
                         yes ? "yes" : "no");
    }
    return out;
  }

  [[nodiscard]] std::string box_of(std::size_t node) const {
    const gesture::DrawnNode& here = tree_.nodes[node];
    const double x = x_px_[column_[node]];
    const double y = middle_px(node) - kNodeHeight_px / 2.0;
    return fmt::format(
        "<rect class=\"{}\" rx=\"4\"{}{}{}{}/><text{}{}>{}</text><text "
        "class=\"quiet\"{}{}>{}</text>"
        "\n",
        here.yes < 0 ? "leaf" : "ask", svg_attribute("x", x), svg_attribute("y", y),
        svg_attribute("width", widths_[column_[node]]), svg_attribute("height", kNodeHeight_px),
        svg_attribute("x", x + kTreePad_px), svg_attribute("y", y + 15.0), escaped(here.words),
        svg_attribute("x", x + kTreePad_px), svg_attribute("y", y + 30.0), escaped(here.reach));
  }

  const gesture::DrawnTree& tree_;
  std::vector<double> y_px_;
  std::vector<std::size_t> column_;
  std::vector<double> widths_, x_px_;  // [column]
  double next_px_ = 0.0;
};

}  // namespace

Figure decision_trees(const std::string& title, const std::vector<gesture::DrawnTree>& trees,
                      bool folded) {
  Figure figure{.title = title,
                .sentence =
                    "Follow the answers from the left: every gesture, also one that was "
                    "never recorded, ends in a leaf, whose poses it shares. Below a "
                    "question stand the contexts that come there, before-gesture-after; "
                    "* is any label.",
                .drawings = {},
                .tables = {},
                .folded = folded};
  for (const gesture::DrawnTree& tree : trees)
    figure.drawings.push_back(TreeDrawing(tree).drawing());
  return figure;
}

namespace {

constexpr double kHandRow_px = 110.0, kBodyRow_px = 170.0;

}  // namespace

Figure gesture_strip(const std::string& title, const std::string& sentence,
                     const std::vector<picture::StripRow>& rows, const picture::Camera& camera,
                     bool ground) {
  const auto layout = picture::layout_of(rows, camera, ground ? kBodyRow_px : kHandRow_px, ground);
  auto strip = picture::draw_strip(rows, camera, layout, {.title = "", .sentence = ""});
  return {.title = title,
          .sentence = sentence,
          .drawings = {{.width_px = strip.width_px,
                        .height_px = strip.height_px,
                        .elements = std::move(strip.elements),
                        .kind = "strip"}},
          .tables = {}};
}

namespace {

constexpr double kCell_px = 54.0, kCellHeight_px = 34.0, kConfusionLeft_px = 190.0;
constexpr double kConfusionTop_px = 48.0;
constexpr const char* kColumns = "recognised label [% of the frames]";
constexpr double kMaxOpacity = 0.6;  // opacity of a full cell, on which text can still be read

std::string cell_at(double x, double y, double share, bool agrees) {
  std::string out = fmt::format("<rect class=\"cell {} fill\"{}{}{}{} fill-opacity=\"{:.3f}\"/>\n",
                                agrees ? "s0" : "s1", svg_attribute("x", x), svg_attribute("y", y),
                                svg_attribute("width", kCell_px),
                                svg_attribute("height", kCellHeight_px), kMaxOpacity * share);
  if (share < 0.0005) return out;
  return out + fmt::format("<text class=\"mid\"{}{}>{}</text>\n",
                           svg_attribute("x", x + kCell_px / 2.0),
                           svg_attribute("y", y + kCellHeight_px / 2.0 + 4.0),
                           number_text(100.0 * share, 1));
}

}  // namespace

Figure label_confusion(const Confusion& confusion) {
  assert(confusion.share.size() == confusion.given.size());
  assert(confusion.frames.size() == confusion.given.size());
  std::string out = fmt::format(
      "<text class=\"quiet\"{} y=\"16\">{}</text>\n"
      "<text class=\"quiet end\"{}{}>given label</text>\n",
      svg_attribute("x", kConfusionLeft_px), kColumns, svg_attribute("x", kConfusionLeft_px - 10.0),
      svg_attribute("y", kConfusionTop_px - 10.0));
  for (std::size_t c = 0; c < confusion.labels.size(); ++c) {
    out += fmt::format(
        "<text class=\"mid head\"{}{}>{}</text>\n",
        svg_attribute("x", kConfusionLeft_px + kCell_px * (static_cast<double>(c) + 0.5)),
        svg_attribute("y", kConfusionTop_px - 10.0), escaped(clean_name(confusion.labels[c])));
  }
  for (std::size_t r = 0; r < confusion.given.size(); ++r) {
    const double y = kConfusionTop_px + kCellHeight_px * static_cast<double>(r);
    out += fmt::format("<text class=\"end\"{}{}>{} ({} frames)</text>\n",
                       svg_attribute("x", kConfusionLeft_px - 10.0), svg_attribute("y", y + 21.0),
                       escaped(clean_name(confusion.given[r])), confusion.frames[r]);
    for (std::size_t c = 0; c < confusion.labels.size(); ++c) {
      out += cell_at(kConfusionLeft_px + kCell_px * static_cast<double>(c), y,
                     confusion.share[r][c], confusion.labels[c] == confusion.given[r]);
    }
  }
  const double columns_px = kCell_px * static_cast<double>(confusion.labels.size());
  const auto rows = static_cast<double>(confusion.given.size());
  return {
      .title = "Which gesture is recognised",
      .sentence =
          "Blue cells are right, orange ones are mistaken for another gesture, as is to "
          "be expected near the border between two. Measured on " +
          confusion.measured_on + ", frame by frame, as the live stage does.",
      .drawings = {{.width_px = kConfusionLeft_px + std::max(columns_px, text_px(kColumns)) + 8.0,
                    .height_px = kConfusionTop_px + kCellHeight_px * rows + 8.0,
                    .elements = std::move(out)}},
      .tables = {}};
}

Figure lag_error(const std::vector<LagError>& curve, double rate_hz) {
  std::vector<Point> rms;
  std::vector<Point> largest;
  Range frames;
  Range error;
  Table table{.columns = {{"labels known ahead [frames]"},
                          {"[ms]"},
                          {"rms error [deg]"},
                          {"largest error [deg]"},
                          {"jerk over the full solve's [1]"}},
              .rows = {}};
  for (const LagError& point : curve) {
    rms.push_back({static_cast<double>(point.frames), point.rms_deg});
    largest.push_back({static_cast<double>(point.frames), point.max_deg});
    frames.add(point.frames);
    if (point.rms_deg > 0.0) error.add(point.rms_deg);
    error.add(point.max_deg);
    table.rows.push_back({std::to_string(point.frames),
                          number_text(1e3 * point.frames / rate_hz, 0),
                          number_text(point.rms_deg, 4), number_text(point.max_deg, 4),
                          number_text(point.jerk_ratio, 3)});
  }
  Plot plot({"labels known ahead", fmt::format("frames at {:g} Hz", rate_hz), frames},
            Axis::logarithmic("difference to knowing all labels", "deg", error));
  plot.line("largest of any angle", 1, largest);
  plot.marks({}, 1, largest);
  plot.line("rms over all angles", 0, rms);
  plot.marks({}, 0, rms);
  return {.title = "Lag against error",
          .sentence =
              "A stream learns its next labels only some frames ahead: where the lines "
              "have fallen below what the eye sees, a tenth of a degree, more waiting "
              "gains nothing.",
          .drawings = {plot.drawing()},
          .tables = {std::move(table)}};
}

namespace {

constexpr double kDurationWidth_px = 760.0, kDurationLeft_px = 150.0, kDurationRow_px = 30.0;
constexpr double kDurationTop_px = 28.0;

std::string durations_grid(const Axis& axis, double bottom) {
  std::string out;
  for (const Tick& tick : axis.ticks(9)) {
    const double at = axis.px(tick.value);
    out +=
        fmt::format("<line class=\"grid\"{}{}{}{}/><text class=\"quiet mid\"{}{}>{}</text>\n",
                    svg_attribute("x1", at), svg_attribute("x2", at),
                    svg_attribute("y1", kDurationTop_px), svg_attribute("y2", bottom),
                    svg_attribute("x", at), svg_attribute("y", bottom + 16.0), escaped(tick.text));
  }
  return out + fmt::format("<text class=\"mid\"{}{}>{}</text>\n",
                           svg_attribute("x", (kDurationLeft_px + kDurationWidth_px) / 2.0),
                           svg_attribute("y", bottom + 36.0), escaped(axis.label()));
}

std::string durations_row(const LabelDurations& label, const Axis& axis, double y) {
  std::string out =
      fmt::format("<text class=\"end\"{}{}>{}</text>\n", svg_attribute("x", kDurationLeft_px - 8.0),
                  svg_attribute("y", y + 15.0),
                  escaped(label.label + (label.recorded ? "" : " (never recorded)")));
  double from_s = 0.0;
  for (std::size_t s = 0; s < label.mean_s.size(); ++s) {
    const double to_s = from_s + label.mean_s[s];
    if (!axis.shows(to_s)) return out;
    const double x = axis.px(from_s);
    const double width = axis.px(to_s) - x;
    out += fmt::format("<rect class=\"cell {} fill\"{}{}{} height=\"20\"/>\n", series_class(s),
                       svg_attribute("x", x), svg_attribute("y", y), svg_attribute("width", width));
    from_s = to_s;
  }
  return out;
}

}  // namespace

Figure state_durations(const std::vector<LabelDurations>& labels) {
  Range range;
  range.add(0.0);
  for (const LabelDurations& label : labels) {
    double sum_s = 0.0;
    for (const double mean_s : label.mean_s) sum_s += mean_s;
    range.add(sum_s);
  }
  Axis axis("time since the gesture began", "s", range);
  axis.place(kDurationLeft_px, kDurationWidth_px - 16.0);
  std::string out;
  double x = kDurationLeft_px;
  const std::size_t states = labels.empty() ? 0 : labels.front().mean_s.size();
  for (std::size_t s = 0; s < states; ++s) {
    out += fmt::format(
        "<rect class=\"{} fill\"{} y=\"6\" width=\"14\" height=\"11\"/>"
        "<text{} y=\"16\">state {}</text>\n",
        series_class(s), svg_attribute("x", x), svg_attribute("x", x + 19.0), s + 1);
    x += 84.0;
  }
  const double bottom = kDurationTop_px + kDurationRow_px * static_cast<double>(labels.size());
  out += durations_grid(axis, bottom);
  Table table{.columns = {{"gesture", false}}, .rows = {}};
  for (std::size_t s = 0; s < states; ++s) {
    table.columns.push_back({fmt::format("state {} [ms]", s + 1)});
  }
  double y = kDurationTop_px + 5.0;
  for (const LabelDurations& label : labels) {
    out += durations_row(label, axis, y);
    y += kDurationRow_px;
    std::vector<std::string> row{label.label};
    for (std::size_t s = 0; s < label.mean_s.size(); ++s) {
      row.push_back(number_text(1e3 * label.mean_s[s], 0) + " ± " +
                    number_text(1e3 * label.deviation_s[s], 0));
    }
    table.rows.push_back(std::move(row));
  }
  return {.title = "How long the states last",
          .sentence =
              "Each row is a gesture between gestures of its own kind: into the pose "
              "(states 1 and 2), the hold (3 and 4) and out of it (5). Equal rows share a "
              "leaf of the tree of durations. The table gives "
              "mean ± one standard deviation.",
          .drawings = {{.width_px = kDurationWidth_px,
                        .height_px = bottom + 44.0,
                        .elements = std::move(out)}},
          .tables = {std::move(table)}};
}

}  // namespace posed::report
