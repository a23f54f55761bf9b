#include "daemon/tools/style/eval_style_report.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/tools/command/json_numbers.hpp"
#include "daemon/tools/report/bench_sections.hpp"
#include "daemon/tools/style/style_cycles.hpp"
#include "models/style/train/dataset.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::tools {
namespace {

using nlohmann::json;

std::string file_of(const clip::Clip& clip) {
  return std::filesystem::path(clip.path).stem().string();
}

// The clips' own mean cycles, aligned as training aligns them.
Result<std::pair<motion::PoseSpaceSpec, StyleCycles>> cycles_of(const EvaluatedClips& clips) {
  style::DatasetOptions how;
  how.space = clips.space;
  how.rate_hz = clips.rate_hz;
  const std::vector<style::TrainingClip> all{{clips.source, "source", "walker", "walk"},
                                             {clips.styled, "styled", "walker", "walk"},
                                             {clips.target, "target", "walker", "walk"}};
  auto dataset = style::make_dataset(all, {"target"}, how);
  if (!dataset) return std::unexpected(dataset.error());
  if (auto aligned = style::align(*dataset, how); !aligned) {
    return std::unexpected(aligned.error());
  }
  const auto takes = style::clip_cycles(*dataset);
  StyleCycles cycles{.source_name = file_of(clips.source),
                     .target_name = file_of(clips.target),
                     .source = cycle_points(takes[0].coefficients),
                     .styled = cycle_points(takes[1].coefficients),
                     .target = cycle_points(takes[2].coefficients)};
  return std::pair{dataset->spec, std::move(cycles)};
}

double number_of(const json& value) { return value.is_number() ? value.get<double>() : NAN; }

report::Figure ratios(const json& figures) {
  return report::paired_bars(
      {.title = "How far from the target",
       .sentence = "The unstyled walk is 1 by definition and the target 0: the shorter a bar, the "
                   "nearer. The process earns its place where its bar is shorter than that of a "
                   "constant offset.",
       .quantity = "distance of the mean cycle from the target's, over the unstyled one's",
       .unit = "1",
       .series = {"distance"},
       .rows = {{"unstyled", {1.0}},
                {"constant offset", {number_of(figures["constant_cycle_ratio"])}},
                {"styled", {number_of(figures["cycle_ratio"])}},
                {"styled, frame by frame", {number_of(figures["ratio"])}}},
       .digits = 3});
}

report::Figure feet(const json& figures) {
  report::PairedBars bars{.title = "How standing feet slide",
                          .sentence =
                              "A standing foot of a real walk hardly moves; a styled bar "
                              "much longer than the source's is skating, which --root "
                              "stride mends.",
                          .quantity = "speed of ankles and toes that stand",
                          .unit = "cm/s",
                          .series = {"speed"},
                          .rows = {},
                          .digits = 1};
  for (const char* clip : {"source", "styled", "target"}) {
    bars.rows.push_back({clip, {number_of(figures["slide_cm_s"][clip])}});
  }
  return report::paired_bars(bars);
}

}  // namespace

Result<> write_eval_style_report(const json& figures, const EvaluatedClips& clips,
                                 const std::filesystem::path& path) {
  const auto measured = cycles_of(clips);
  if (!measured) return std::unexpected(measured.error());
  const auto& [spec, cycles] = *measured;
  const auto drawn = CycleFigures::make(clips.source, spec);
  if (!drawn) return std::unexpected(drawn.error());
  report::Page page("Evaluation of a style",
                    "posed eval style, " + cycles.source_name + " towards " + cycles.target_name);
  page.verdict(figures["verdict"].get<std::string>(), figures["helps"].get<bool>());
  page.section("How near it comes");
  page.add(ratios(figures));
  page.add(drawn->poses(cycles));
  page.add(drawn->paths(cycles));
  page.add(drawn->residuals(cycles));
  page.section("The feet");
  page.add(feet(figures));
  page.section("Numbers");
  page.add(report::all_numbers("Every number", "`posed eval style --help` explains each of them.",
                               numbers_of(figures)));
  add_json(figures, page);
  return report::write_page(page, path);
}

}  // namespace posed::tools
