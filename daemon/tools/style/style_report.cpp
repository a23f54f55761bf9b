#include "daemon/tools/style/style_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/degrees.hpp"
#include "daemon/tools/command/json_numbers.hpp"
#include "daemon/tools/report/style_sections.hpp"
#include "daemon/tools/style/style_cycles.hpp"
#include "models/gp/regression.hpp"
#include "models/style/train/training_check.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::tools {
namespace {

using Eigen::MatrixXd;

constexpr std::size_t kOpenCycles = 2;  // pairs of styles whose figures are not folded away

std::string stem_of(const std::string& file) { return std::filesystem::path(file).stem().string(); }

report::StyleMap map_of(const MatrixXd& rows, double to_unit) {
  const Plane plane = plane_of(rows);
  const MatrixXd places = to_unit * plane.of(rows);
  report::StyleMap map;
  map.first_share = plane.first_share;
  map.second_share = plane.second_share;
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    map.marks.push_back({{}, {}, places(i, 0), places(i, 1)});
  }
  return map;
}

// The style points of one motion, as the model of phases has found them.
report::StyleMap map_of_style_points(const style::Dataset& dataset, const std::string& motion) {
  std::vector<const style::Subject*> subjects;
  for (const style::Subject& subject : dataset.subjects) {
    if (subject.motion == motion) subjects.push_back(&subject);
  }
  MatrixXd rows(std::ssize(subjects), subjects.front()->xi.size());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) = subjects[static_cast<std::size_t>(i)]->xi.transpose();
  }
  report::StyleMap map = map_of(rows, 1.0);
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    map.marks[i].name = subjects[i]->name;
    map.marks[i].group = subjects[i]->group;
  }
  map.what = "style points xi of motion " + motion;
  map.of_axis = "xi";
  map.unit = "no unit";
  map.explanation =
      "xi is what the multifactor Gaussian process found for a person whose strides "
      "it explains; only distances and directions have a meaning.";
  return map;
}

// Without style points: the clips' own mean cycles.
report::StyleMap map_of_cycles(const style::Dataset& dataset, const std::string& motion) {
  const auto takes = style::clip_cycles(dataset);
  std::vector<std::size_t> clips;
  for (std::size_t c = 0; c < dataset.clips.size(); ++c) {
    if (dataset.clips[c].motion == motion) clips.push_back(c);
  }
  MatrixXd rows(std::ssize(clips), kReportPhases * dataset.dims());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) =
        cycle_points(takes[clips[static_cast<std::size_t>(i)]].coefficients).reshaped().transpose();
  }
  const double joints = static_cast<double>(dataset.spec.joints.size());
  report::StyleMap map = map_of(rows, kDegrees / std::sqrt(kReportPhases * joints));
  for (std::size_t i = 0; i < clips.size(); ++i) {
    map.marks[i].name = stem_of(dataset.clips[clips[i]].file);
    map.marks[i].group = dataset.clips[clips[i]].group;
  }
  map.what = "mean cycles of motion " + motion;
  map.of_axis = "mean cycle";
  map.unit = "deg rms";
  map.explanation =
      "Each mark is a clip's mean cycle; the style points xi of the paper need the "
      "model of phases, which --mode paper fits.";
  return map;
}

// What was learnt, for people; empty where it was not measured.
std::vector<report::NamedNumber> kernel_numbers(const nlohmann::json& figures) {
  std::vector<report::NamedNumber> rows;
  const auto add = [&](const std::string& name, const nlohmann::json& value, double factor = 1.0) {
    if (!value.is_number()) return;
    rows.push_back({name, fmt::format("{:.4g}", factor * value.get<double>())});
  };
  const nlohmann::json& kernel = figures["kernel"];
  add("length of the kernel [deg]", kernel["length_deg"]);
  add("lambda, log of the signal's variance [log rad^2]", kernel["lambda"]);
  add("mu, 1 / length^2 [1/rad^2]", kernel["mu"]);
  add("b, constant part [rad^2]", kernel["b"]);
  add("noise, variance [rad^2]", figures["noise"]);
  add("training poses [1]", figures["training_points"]);
  add("dimensions of a pose [1]", figures["dims"]);
  add("rate [Hz]", figures["rate_hz"]);
  if (!figures.contains("targets")) {
    add("groups apart, rms over joints [deg]", figures["difference_deg"]);
    add("takes of one person apart, rms over joints [deg]", figures["scatter_deg"]);
    add("closed of the way to the target [%]", figures["closes"], 100.0);
    add("closed by a constant [%]", figures["constant_closes"], 100.0);
  }
  if (figures.contains("mgpm")) {
    for (const auto& [motion, fit] : figures["mgpm"].items()) {
      add("model of phases of " + motion + ", gamma [1]", fit["gamma"]);
      add("model of phases of " + motion + ", noise [1]", fit["noise"]);
      add("model of phases of " + motion + ", log posterior [1]", fit["log_posterior"]);
    }
  }
  return rows;
}

void add_figures(const std::string& section, const std::vector<report::Figure>& figures,
                 report::Page& page) {
  if (figures.empty()) return;
  page.section(section);
  for (const report::Figure& figure : figures) page.add(figure);
}

}  // namespace

void StyleReport::look(const style::Findings& findings) {
  add_map(findings);
  add_cycles(findings);
  add_kernel(findings);
  add_strides(findings);
}

void StyleReport::add_map(const style::Findings& findings) {
  const style::Dataset& dataset = findings.dataset;
  for (const std::string& motion : dataset.motions) {
    const bool fitted = style::is_in(dataset.fitted, motion);
    styles_.push_back(report::style_map(fitted ? map_of_style_points(dataset, motion)
                                               : map_of_cycles(dataset, motion)));
  }
}

void StyleReport::add_cycles(const style::Findings& findings) {
  const auto figures = CycleFigures::make(clips_.front().clip, findings.dataset.spec);
  if (!figures) {
    drawn_ = std::unexpected(figures.error());
    return;
  }
  std::size_t pairs = 0;
  for (std::size_t l = 0; l < findings.lessons.size(); ++l) {
    const style::Dataset& data = *findings.lessons[l].data;
    const auto takes = style::clip_cycles(data);
    for (const auto& found : style::differences_of(data, takes, findings.lessons[l].target)) {
      StyleCycles cycles{
          .motion = found.motion,
          .source_name = found.group,
          .target_name = findings.lessons[l].target,
          .source = cycle_points(style::group_cycle(data, takes, found.group, found.motion)),
          .styled = {},
          .target = {}};
      cycles.styled = cycles.source + gp::posterior_mean(findings.learnt[l].process, cycles.source);
      cycles.target = cycles.source + cycle_points(found.delta);
      const bool folded = pairs++ >= kOpenCycles;
      std::vector drawn{figures->poses(cycles), figures->paths(cycles), figures->residuals(cycles)};
      drawn.back().sentence +=
          " Measured on the cycles that it learnt from, so it flatters; `posed eval style` judges "
          "other takes.";
      for (report::Figure& figure : drawn) {
        figure.folded = folded;
        cycles_.push_back(std::move(figure));
      }
    }
  }
}

void StyleReport::add_kernel(const style::Findings& findings) {
  const style::Learnt& first = findings.learnt.front();  // all share the kernel
  const auto joints = static_cast<double>(findings.dataset.spec.joints.size());
  const auto length_deg = [](double rad) { return kDegrees * rad; };
  std::vector<report::TriedLength> tried;
  tried.reserve(first.tried.size());
  for (const style::TriedKernel& one : first.tried) {
    tried.push_back({length_deg(one.kernel.length_rad), one.kernel.noise,
                     kDegrees * std::sqrt(one.error / joints)});
  }
  if (!tried.empty()) {
    const auto best = std::ranges::min_element(tried, {}, &report::TriedLength::error_deg);
    kernel_.push_back(report::kernel_choice(tried, best->length_deg, best->noise));
  }
  for (std::size_t l = 0; l < findings.lessons.size(); ++l) {
    const style::Learnt& learnt = findings.learnt[l];
    std::vector<report::HeldOutWalker> walkers;
    for (std::size_t f = 0; f < learnt.ways.size(); ++f) {
      if (!learnt.ways[f].measured()) continue;
      walkers.push_back({stem_of(learnt.held_out[f].file), learnt.held_out[f].person,
                         learnt.held_out[f].clips, learnt.ways[f].closes(),
                         learnt.ways[f].constant_closes()});
    }
    if (walkers.empty()) continue;
    report::Figure figure = report::held_out_walkers(walkers);
    if (findings.lessons.size() > 1) figure.title += ", towards " + findings.lessons[l].target;
    kernel_.push_back(std::move(figure));
  }
}

void StyleReport::add_strides(const style::Findings& findings) {
  const style::Dataset& dataset = findings.dataset;
  std::vector<report::ClipStride> clips;
  clips.reserve(dataset.clips.size());
  for (const style::AlignedClip& clip : dataset.clips) {
    clips.push_back({.clip = stem_of(clip.file),
                     .group = clip.group,
                     .score = clip.stride_score,
                     .period_s = 2.0 * std::numbers::pi / clip.dtheta / dataset.rate_hz,
                     .residual_deg = style::cycle_residual_deg(dataset, clip),
                     .frames = static_cast<int>(clip.q.rows())});
  }
  strides_.push_back(report::stride_scores(clips, style::kUnevenStrides, style::kNoStrides));
}

Result<> StyleReport::write(const nlohmann::json& figures,
                            const std::filesystem::path& path) const {
  if (!drawn_) return drawn_;
  report::Page page("Training of a style",
                    "posed train style, mode " + figures["mode"].get<std::string>());
  page.verdict(figures["verdict"].get<std::string>(), figures["usable"].get<bool>());
  for (const char* list : {"problems", "warnings"}) {
    page.warnings(figures[list].get<std::vector<std::string>>());
  }
  add_figures("Styles", styles_, page);
  add_figures("What the model adds", cycles_, page);
  page.section("How it was learnt");
  std::string sentence =
      "Poses farther apart than the kernel's length, which counts over all joints together, know "
      "little of each other.";
  if (kernel_.empty()) {
    sentence +=
        " No walker was left out to judge it: mode paper learns from all clips; the default mode "
        "tries its kernels on walkers that they did not learn from.";
  }
  page.add(report::all_numbers("The kernel, and what it was learnt from", sentence,
                               kernel_numbers(figures)));
  for (const report::Figure& figure : kernel_) page.add(figure);
  add_figures("The clips", strides_, page);
  add_json(figures, page);
  return report::write_page(page, path);
}

}  // namespace posed::tools
