#include "daemon/tools/style/style_report.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <spdlog/fmt/fmt.h>
#include <Eigen/Core>

#include "daemon/tools/command/options.hpp"
#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/report/plot.hpp"
#include "daemon/tools/report/style_sections.hpp"
#include "models/gp/regression.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/style/train/dataset.hpp"
#include "models/style/train/difference_process.hpp"
#include "models/style/train/train_report.hpp"
#include "models/style/train/training_check.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Phases of a cycle in the figures; a multiple of eight.
constexpr int kReportPhases = 56;

// Mean cycles of one motion at the same phases [kReportPhases x dims], rad. `target` is what the
// source should become.
struct StyleCycles {
  std::string motion{}, source_name, target_name;  // `motion` may be empty
  Eigen::MatrixXd source, styled, target;

  [[nodiscard]] std::string what() const;
};

class CycleFigures {
 public:
  // `clip`: whose bones are drawn. It has frames.
  static Result<CycleFigures> make(const clip::Clip& clip, const motion::PoseSpaceSpec& spec);

  [[nodiscard]] report::Figure poses(const StyleCycles& cycles) const;
  [[nodiscard]] report::Figure paths(const StyleCycles& cycles) const;
  [[nodiscard]] report::Figure residuals(const StyleCycles& cycles) const;

 private:
  CycleFigures(motion::PoseSpaceSpec spec, motion::PoseSpace space, const Frame& base,
               std::shared_ptr<const Skeleton> skeleton);
  [[nodiscard]] picture::Figure pose(const Eigen::VectorXd& q) const;

  motion::PoseSpaceSpec spec_;
  motion::PoseSpace space_;
  Frame base_;  // the joints that the style does not change, and the height of the root
  picture::FigureShape shape_;
};

// The two directions of the largest variance of `rows` about their mean, and the shares of all
// variance that they have, 0 where there is none.
struct Plane {
  Eigen::RowVectorXd middle;
  Eigen::MatrixXd directions;  // [columns x 2]
  double first_share = 0.0, second_share = 0.0;

  [[nodiscard]] Eigen::MatrixXd of(const Eigen::MatrixXd& rows) const {
    return (rows.rowwise() - middle) * directions;
  }
};

constexpr int kPosesShown = 8;

report::PosePaths::Path path_of(std::string name, const MatrixXd& points_rad) {
  report::PosePaths::Path path{std::move(name), {}};
  for (Eigen::Index i = 0; i < points_rad.rows(); ++i) {
    path.points.push_back({kDegrees * points_rad(i, 0), kDegrees * points_rad(i, 1)});
  }
  return path;
}

std::string StyleCycles::what() const {
  return fmt::format("{}{}\"{}\" to \"{}\"", motion, motion.empty() ? "" : ", ", source_name,
                     target_name);
}

// The points of a cycle, given by its harmonic coefficients.
MatrixXd cycle_points(const MatrixXd& coefficients) {
  return style::harmonic_basis(style::cycle_phases(kReportPhases), style::kCycleHarmonics) *
         coefficients;
}

Plane plane_of(const MatrixXd& rows) {
  Plane plane;
  plane.middle = rows.colwise().mean();
  plane.directions = MatrixXd::Zero(rows.cols(), 2);
  const MatrixXd centred = rows.rowwise() - plane.middle;
  // The smaller of the two products has the same values that are not zero.
  const bool wide = centred.cols() > centred.rows();
  const auto eigen = motion::symmetric_eigen(wide ? MatrixXd(centred * centred.transpose())
                                                  : MatrixXd(centred.transpose() * centred));
  const double sum = eigen.values.sum();
  const Eigen::Index last = eigen.values.size() - 1;
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(2, last + 1); ++k) {
    const VectorXd found = eigen.vectors.col(last - k);
    const VectorXd direction = wide ? VectorXd(centred.transpose() * found) : found;
    if (!(direction.norm() > 0.0) || !(sum > 0.0)) continue;
    plane.directions.col(k) = direction.normalized();
    (k == 0 ? plane.first_share : plane.second_share) = eigen.values[last - k] / sum;
  }
  return plane;
}

CycleFigures::CycleFigures(motion::PoseSpaceSpec spec, motion::PoseSpace space, const Frame& base,
                           std::shared_ptr<const Skeleton> skeleton)
    : spec_(std::move(spec)), space_(std::move(space)), base_(base), shape_(std::move(skeleton)) {}

Result<CycleFigures> CycleFigures::make(const clip::Clip& clip, const motion::PoseSpaceSpec& spec) {
  auto motion = TRY(motion::performed_motion_of(clip));
  auto space = TRY(motion::PoseSpace::bind(spec, *motion.skeleton));
  Frame base = motion.frames[motion.frames.size() / 2];
  double height_m = 0.0;
  for (const Frame& frame : motion.frames) {
    height_m += static_cast<double>(frame.root_position_m[1]) / motion.size();
  }
  base.root_position_m = {0.0F, static_cast<float>(height_m), 0.0F};
  return CycleFigures(spec, std::move(space), base, motion.skeleton);
}

picture::Figure CycleFigures::pose(const VectorXd& q) const {
  const std::size_t dims = space_.dims();
  std::vector<float> now(dims);
  std::vector<float> change(dims);
  std::vector<std::uint8_t> available(dims);
  Frame frame = base_;
  space_.to_vector(frame, 0.0, now, available);
  for (std::size_t d = 0; d < dims; ++d) {
    change[d] = static_cast<float>(q[static_cast<Eigen::Index>(d)]) - now[d];
  }
  space_.add(frame, 0.0, now, change);
  return shape_.pose(frame);
}

report::Figure CycleFigures::poses(const StyleCycles& cycles) const {
  report::CycleRows rows;
  rows.title = "Mean cycles side by side: " + cycles.what();
  rows.sentence = fmt::format(
      "One stride at eight phases: how the second row differs from the first is what the model "
      "adds, how it differs from the third is what it misses. Phase 0 is the right thigh farthest "
      "in front; {}, and the ground is marked each 0.5 m.",
      shape_.legend());
  const std::pair<std::string, const MatrixXd*> all[]{
      {cycles.source_name + ", the mean of its cycles", &cycles.source},
      {"styled", &cycles.styled},
      {cycles.target_name + ", what it should become", &cycles.target}};
  for (const auto& [title, points] : all) {
    picture::StripRow row{.title = title, .poses = {}};
    for (int i = 0; i < kPosesShown; ++i) {
      row.poses.push_back({.figure = pose(points->row(i * kReportPhases / kPosesShown).transpose()),
                           .caption = fmt::format("{}°", i * 360 / kPosesShown)});
    }
    rows.rows.push_back(std::move(row));
  }
  for (const auto view : {picture::View::kFront, picture::View::kSide}) {
    rows.views.push_back({.camera = picture::Camera(view, shape_.facing(0.0)),
                          .from = std::string(picture::view_words(view))});
  }
  return report::cycle_strips(rows);
}

report::Figure CycleFigures::paths(const StyleCycles& cycles) const {
  const Plane plane = plane_of(cycles.source);
  return report::pose_paths(
      {.what = cycles.what(),
       .input = path_of("input: " + cycles.source_name, plane.of(cycles.source)),
       .output = path_of("output: styled", plane.of(cycles.styled)),
       .goal = path_of("target: " + cycles.target_name, plane.of(cycles.target)),
       .first_share = plane.first_share,
       .second_share = plane.second_share});
}

report::Figure CycleFigures::residuals(const StyleCycles& cycles) const {
  std::vector<report::JointResidual> joints;
  joints.reserve(spec_.joints.size());
  for (const std::string& name : spec_.joints) joints.push_back({name, 0.0, 0.0});
  for (int d = 0; d < space_.dims(); ++d) {
    report::JointResidual& joint = joints[space_.joint_of_dim(d)];
    joint.before_deg += (cycles.source.col(d) - cycles.target.col(d)).squaredNorm();
    joint.after_deg += (cycles.styled.col(d) - cycles.target.col(d)).squaredNorm();
  }
  for (report::JointResidual& joint : joints) {
    joint.before_deg = kDegrees * std::sqrt(joint.before_deg / kReportPhases);
    joint.after_deg = kDegrees * std::sqrt(joint.after_deg / kReportPhases);
  }
  return report::joint_residuals(cycles.what(), joints);
}

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
    rows.row(i) = subjects[i]->xi.transpose();
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
    rows.row(i) = cycle_points(takes[clips[i]].coefficients).reshaped().transpose();
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

// What was learnt, as a table for people; without what was not measured.
report::Table kernel_numbers(const style::Findings& findings) {
  report::Table table{.columns = {{"name", false}, {"value"}}, .rows = {}};
  const auto add = [&](const std::string& name, double value) {
    table.rows.push_back({name, fmt::format("{:.4g}", value)});
  };
  const gp::Trained& process = findings.learnt.front().process;  // all share the kernel
  add("length of the kernel [deg]", kDegrees / std::sqrt(process.mu));
  add("lambda, log of the signal's variance [log rad^2]", process.lambda);
  add("mu, 1 / length^2 [1/rad^2]", process.mu);
  add("b, constant part [rad^2]", process.b);
  add("noise, variance [rad^2]", process.noise);
  add("training poses [1]", static_cast<double>(process.inputs.rows()));
  add("dimensions of a pose [1]", findings.dataset.dims());
  add("rate [Hz]", findings.dataset.rate_hz);
  if (findings.checks.size() == 1) {
    const style::TrainingCheck& check = findings.checks.front();
    add("groups apart, rms over joints [deg]", check.difference_deg);
    add("takes of one person apart, rms over joints [deg]", check.scatter_deg);
    if (check.way.measured()) {
      add("closed of the way to the target [%]", 100.0 * check.way.closes());
      add("closed by a constant [%]", 100.0 * check.way.constant_closes());
    }
  }
  for (std::size_t m = 0; m < findings.dataset.fitted.size(); ++m) {
    const style::MgpmFit& fit = findings.dataset.fits[m];
    const std::string of_motion = "model of phases of " + findings.dataset.fitted[m];
    add(of_motion + ", gamma [1]", std::exp(fit.params.log_gamma));
    add(of_motion + ", noise [1]", std::exp(fit.params.log_noise));
    add(of_motion + ", log posterior [1]", -fit.nlp);
  }
  return table;
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
  std::string sentence =
      "Poses farther apart than the kernel's length, which counts over all joints together, know "
      "little of each other.";
  const auto joints = static_cast<double>(findings.dataset.spec.joints.size());
  const auto length_deg = [](double rad) { return kDegrees * rad; };
  std::vector<report::TriedLength> tried;
  tried.reserve(first.tried.size());
  for (const style::TriedKernel& one : first.tried) {
    tried.push_back({length_deg(one.kernel.length_rad), one.kernel.noise,
                     kDegrees * std::sqrt(one.error / joints)});
  }
  report::Figure numbers{.title = "The kernel, and what it was learnt from",
                         .sentence = std::move(sentence),
                         .drawings = {},
                         .tables = {kernel_numbers(findings)}};
  kernel_.push_back(std::move(numbers));
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
  if (kernel_.size() == 1) {
    kernel_.front().sentence +=
        " No walker was left out to judge it: mode paper learns from all clips; the default mode "
        "tries its kernels on walkers that they did not learn from.";
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

Result<> StyleReport::write(const style::TrainingVerdict& verdict, const std::string& mode,
                            const Findings& findings, const std::filesystem::path& path) const {
  if (!drawn_) return drawn_;
  report::Page page("Training of a style", "posed train style, mode " + mode);
  page.verdict(verdict.sentence, verdict.usable);
  page.warnings(verdict.problems);
  page.warnings(verdict.warnings);
  add_figures("Styles", styles_, page);
  add_figures("What the model adds", cycles_, page);
  add_figures("How it was learnt", kernel_, page);
  add_figures("The clips", strides_, page);
  add_json(findings, page);
  return report::write_page(page, path);
}

namespace {

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
  auto dataset = TRY(style::make_dataset(all, {"target"}, how));
  TRY(style::align(dataset, how));
  const auto takes = style::clip_cycles(dataset);
  StyleCycles cycles{.source_name = file_of(clips.source),
                     .target_name = file_of(clips.target),
                     .source = cycle_points(takes[0].coefficients),
                     .styled = cycle_points(takes[1].coefficients),
                     .target = cycle_points(takes[2].coefficients)};
  return std::pair{dataset.spec, std::move(cycles)};
}

// A bar for each value.
report::Figure bars_of(const std::vector<std::pair<std::string, double>>& values, std::string title,
                       std::string sentence, report::Bars bars) {
  for (const auto& [name, value] : values) bars.groups.push_back({name, {value}});
  return report::bars_figure(std::move(title), std::move(sentence), bars);
}

}  // namespace

Result<> write_eval_style_report(const StyleEvaluation& evaluation, const EvaluatedClips& clips,
                                 const std::filesystem::path& path) {
  const auto measured = TRY(cycles_of(clips));
  const auto& [spec, cycles] = measured;
  const auto drawn = TRY(CycleFigures::make(clips.source, spec));
  report::Page page("Evaluation of a style",
                    "posed eval style, " + cycles.source_name + " towards " + cycles.target_name);
  page.verdict(evaluation.verdict, evaluation.helps);
  page.section("How near it comes");
  page.add(bars_of(evaluation.distances, "How far from the target",
                   "The unstyled walk is 1 by definition and the target 0: the shorter a bar, the "
                   "nearer. The process earns its place where its bar is shorter than that of a "
                   "constant offset.",
                   {.quantity = "distance of the mean cycle from the target's, over the unstyled "
                                "one's",
                    .unit = "1",
                    .series = {"distance"},
                    .groups = {},
                    .digits = 3}));
  page.add(drawn.poses(cycles));
  page.add(drawn.paths(cycles));
  page.add(drawn.residuals(cycles));
  page.section("The feet");
  page.add(bars_of(evaluation.slides_cm_s, "How standing feet slide",
                   "A standing foot of a real walk hardly moves; a styled bar much longer than the "
                   "source's is skating, which --root stride mends.",
                   {.quantity = "speed of ankles and toes that stand",
                    .unit = "cm/s",
                    .series = {"speed"},
                    .groups = {}}));
  add_numbers(evaluation.findings, "`posed eval style --help` explains each of them.", page);
  add_json(evaluation.findings, page);
  return report::write_page(page, path);
}

}  // namespace posed::tools
