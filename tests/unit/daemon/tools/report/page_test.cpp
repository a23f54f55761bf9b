// Reports: what a page may not contain, whatever the data are: markup from outside, numbers that
// are none, anything that is loaded.
#include "daemon/tools/report/page.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include <pugixml.hpp>

#include "daemon/tools/report/gesture_sections.hpp"
#include "daemon/tools/report/plot.hpp"
#include "daemon/tools/report/style_sections.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::report {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();
const std::string kEvil = "<script>alert(\"1\")</script> & 'more'\n\x1b[31m";

std::string page_with(const std::vector<Figure>& figures) {
  Page page("Test", "posed test");
  for (const Figure& figure : figures) page.add(figure);
  return page.html();
}

// The page is read by an XML parser, and no attribute of it is no number.
void check_page(const std::string& html) {
  pugi::xml_document document;
  const auto parsed = document.load_string(html.c_str(), pugi::parse_full);
  INFO(parsed.description() << " at " << html.substr(static_cast<std::size_t>(parsed.offset), 60));
  REQUIRE(parsed);
  CHECK_FALSE(html.contains("<script"));
  CHECK_FALSE(html.contains("\x1b"));
  for (const auto& svg : document.select_nodes("//svg//*")) {
    for (const auto& attribute : svg.node().attributes()) {
      const std::string value = attribute.value();
      CAPTURE(svg.node().name(), attribute.name(), value);
      CHECK(value.find("nan") == std::string::npos);
      CHECK(value.find("inf") == std::string::npos);
    }
  }
}

picture::StripRow evil_row() {
  picture::Figure figure;
  figure.sticks.push_back(
      {.from_m = {0.0, 0.0, 0.0}, .to_m = {0.0, 1.0, 0.0}, .width_m = 0.1, .colour = "#0072b2"});
  return {.title = kEvil, .poses = {{.figure = figure, .caption = kEvil}}};
}

// Every figure of styles from the same values and words.
std::vector<Figure> style_figures(double value, const std::string& words, std::size_t count) {
  StyleMap map{.what = words, .of_axis = words, .unit = "1", .marks = {}, .explanation = words};
  PosePaths paths{.what = words, .input = {words, {}}, .output = {words, {}}, .goal = {}};
  std::vector<TriedLength> tried;
  std::vector<HeldOutWalker> walkers;
  std::vector<JointResidual> joints;
  std::vector<ClipStride> clips;
  for (std::size_t i = 0; i < count; ++i) {
    map.marks.push_back({words, words, value, value});
    paths.input.points.push_back({value, value});
    paths.output.points.push_back({value, 1.0});
    tried.push_back({value, value, value});
    walkers.push_back({words, words, 1, value, value});
    joints.push_back({words, value, value});
    clips.push_back({words, words, value, value, value, 3});
  }
  return {style_map(map),
          pose_paths(paths),
          kernel_choice(tried, value, value),
          held_out_walkers(walkers),
          joint_residuals(words, joints),
          stride_scores(clips, 0.2, 0.5)};
}

std::vector<Figure> other_figures(double value, const std::string& words, std::size_t count) {
  std::vector<LabelDurations> durations;
  std::vector<AngleTrajectory> angles;
  std::vector<LabelSpan> spans;
  std::vector<LagError> lags;
  Confusion confusion{.labels = {}, .given = {}, .share = {}, .frames = {}, .measured_on = words};
  std::vector<gesture::DrawnTree> trees;
  Bars bars{.quantity = words,
            .unit = words,
            .series = {words, words},
            .groups = {},
            .logarithmic = true};
  for (std::size_t i = 0; i < count; ++i) {
    durations.push_back({words, false, {value, value}, {value, value}});
    angles.push_back({words, {{value, value}}, {{value, 1.0}}, {{1.0, value}}, {{1.0, value}}});
    spans.push_back({words, value, value});
    lags.push_back({static_cast<int>(i), value, value, value});
    confusion.labels.push_back(words);
    confusion.given.push_back(words);
    confusion.share.emplace_back(count, std::isfinite(value) ? 0.5 : 0.0);
    confusion.frames.push_back(1);
    trees.push_back({words, {{words, words, 1, 2}, {words, words}, {words, words}}});
    bars.groups.push_back({words, {value, value}});
  }
  trees.push_back({words, {}});
  return {state_durations(durations),
          angle_trajectories(words, words, words, angles, spans),
          lag_error(lags, 30.0),
          label_confusion(confusion),
          decision_trees(words, trees, true),
          bars_figure(words, words, bars)};
}

}  // namespace

TEST_CASE("marks on one line get no axis of rounding errors", "[report]") {
  const Figure figure =
      style_map({.what = "walk",
                 .of_axis = "xi",
                 .unit = "no unit",
                 .marks = {{"ann", "from", -0.06, 5.2e-17}, {"ann", "to", 0.06, 4.8e-17}},
                 .explanation = {}});
  CHECK_FALSE(test::has(figure.drawings.front().elements, "e-1"));
}

TEST_CASE("the confusion of two labels is as wide as its words", "[report]") {
  const Figure figure = label_confusion({.labels = {"g", "c"},
                                         .given = {"g"},
                                         .share = {{1.0, 0.0}},
                                         .frames = {3},
                                         .measured_on = "the reference"});
  CHECK(figure.drawings.front().width_px > 190.0 + text_px("recognised label [% of the frames]"));
}

TEST_CASE("text from outside stays text in a report", "[report]") {
  CHECK(escaped("<a href=\"x\">'&") == "&lt;a href=&quot;x&quot;&gt;&#39;&amp;");
  Page page(kEvil, kEvil);
  page.verdict(kEvil, false);
  page.warnings({kEvil});
  page.section(kEvil);
  page.add({.title = kEvil,
            .sentence = kEvil,
            .drawings = {},
            .tables = {{.columns = {{kEvil}}, .rows = {{kEvil}}}}});
  page.text(kEvil, kEvil, kEvil);
  check_page(page.html());
  CHECK(test::has(page.html(), "&lt;script&gt;"));
  check_page(page_with(style_figures(1.5, kEvil, 3)));
  check_page(page_with(other_figures(1.5, kEvil, 3)));
  CycleRows rows{.title = kEvil, .sentence = kEvil, .views = {}, .rows = {evil_row()}};
  rows.views.push_back({picture::Camera(picture::View::kFront, {}), kEvil});
  check_page(page_with({cycle_strips(rows)}));
}

TEST_CASE("a report without data, and one with broken numbers, is a page all the same",
          "[report]") {
  check_page(Page("Nothing", "posed test").html());
  check_page(page_with(style_figures(0.0, "empty", 0)));
  check_page(page_with(other_figures(0.0, "empty", 0)));
  for (const double value : {0.0, -1.0, 1e-310, 1e300, kNan, kInfinity, -kInfinity}) {
    CAPTURE(value);
    check_page(page_with(style_figures(value, "value", 3)));
    check_page(page_with(other_figures(value, "value", 3)));
  }
  CHECK(number_text(kNan, 1) == "–");
  CHECK(number_text(1.25, 1) == "1.2");
}

TEST_CASE("a report loads nothing and says how it looks in the dark and on paper", "[report]") {
  const std::string html = page_with(other_figures(1.5, "value", 2));
  CHECK_FALSE(html.contains("http://"));
  CHECK_FALSE(html.contains("https://"));
  CHECK_FALSE(html.contains("@import"));
  CHECK_FALSE(html.contains("url("));
  CHECK(html.contains("default-src 'none'"));
  CHECK(html.contains("prefers-color-scheme:dark"));
  CHECK(html.contains("@media print"));
}

TEST_CASE("a line of a plot has gaps where it has no values", "[report]") {
  Range range;
  range.add(0.0);
  range.add(4.0);
  Plot plot({"x", "s", range}, {"y", "deg", range});
  const std::vector<Point> points{{0, 1}, {1, 1}, {2, kNan}, {3, 1}, {4, 1}};
  plot.line("a", 0, points);
  plot.line("b", 1, {});
  plot.line("c", 2, {}, true);
  const std::string drawn = plot.drawing().elements;
  std::size_t lines = 0;
  for (auto at = drawn.find("<polyline class=\"s0"); at != std::string::npos;
       at = drawn.find("<polyline class=\"s0", at + 1)) {
    ++lines;
  }
  CHECK(lines == 3);  // a sample in the legend and two pieces
  CHECK(drawn.contains("x [s]"));
  CHECK(drawn.contains("y [deg]"));
}

TEST_CASE("a report is written whole", "[report]") {
  const test::TempFolder folder;
  REQUIRE(write_page(Page("Test", "posed test"), folder.path() / "a.html"));
  CHECK(test::has(test::file_text(folder.path() / "a.html"), "</html>"));
  CHECK_FALSE(write_page(Page("Test", "posed test"), folder.path() / "no" / "a.html"));
}

TEST_CASE("a drawing is a file without its page, and foreign words stay words", "[report]") {
  const Figure trees = decision_trees(
      "", {{kEvil, {{kEvil, kEvil, 1, 2}, {kEvil, kEvil}, {kEvil, kEvil}}}, {"two", {}}}, false);
  const std::string svg = svg_file(trees.drawings);
  CHECK(svg.find("<svg") == 0);
  CHECK(svg.find("<script") == std::string::npos);
  pugi::xml_document document;
  REQUIRE(document.load_string(svg.c_str()));
  CHECK(document.child("svg").select_nodes(".//rect[@class='leaf']").size() == 2);
  CHECK(document.child("svg").select_nodes(".//rect[@class='ask']").size() == 1);
  CHECK(document.child("svg").select_nodes("g").size() == 2);  // one below the other
}

}  // namespace posed::report
