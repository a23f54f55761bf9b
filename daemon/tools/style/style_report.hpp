// What `posed train style --report` and `posed eval style --report` show: the styles' mean cycles
// as poses, as paths and joint by joint, and how they were learnt. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/report/page.hpp"
#include "models/motion/pose_space.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// The page of a training: gathers its figures while the training's findings are there.
class StyleReport {
 public:
  // `clips`: of the training; they outlive the report.
  explicit StyleReport(const std::vector<style::TrainingClip>& clips) : clips_(clips) {}

  // For style::TrainOptions::look.
  void look(const style::Findings& findings);

  // `verdict`: of the training; `mode`: its name; `findings`: what `--json` prints.
  Result<> write(const style::TrainingVerdict& verdict, const std::string& mode,
                 const Findings& findings, const std::filesystem::path& path) const;

 private:
  void add_map(const style::Findings& findings);
  void add_cycles(const style::Findings& findings);
  void add_kernel(const style::Findings& findings);
  void add_strides(const style::Findings& findings);

  const std::vector<style::TrainingClip>& clips_;
  std::vector<report::Figure> styles_, cycles_, kernel_, strides_;
  Result<> drawn_;
};

// The clips of an evaluation, and how the model sees them.
struct EvaluatedClips {
  clip::Clip source, styled, target;
  motion::Space space = motion::Space::kNative;
  double rate_hz = 30.0;
};

// The numbers of the page's bars have names; one that is not finite is not drawn.
struct StyleEvaluation {
  Findings findings;  // what `--json` prints
  std::string verdict;
  bool helps = true;
  std::vector<std::pair<std::string, double>> distances;    // of the mean cycle, over the source's
  std::vector<std::pair<std::string, double>> slides_cm_s;  // speed of standing feet
};
Result<> write_eval_style_report(const StyleEvaluation& evaluation, const EvaluatedClips& clips,
                                 const std::filesystem::path& path);

}  // namespace posed::tools
