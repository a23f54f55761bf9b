// What `posed train style --report` shows: the page's figures, gathered while the training's
// findings are there, and the page. Cold.
#pragma once

#include <filesystem>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/report/page.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

class StyleReport {
 public:
  // `clips`: of the training; they outlive the report.
  explicit StyleReport(const std::vector<style::TrainingClip>& clips) : clips_(clips) {}

  // For style::TrainOptions::look.
  void look(const style::Findings& findings);

  // `figures`: what `--json` prints.
  [[nodiscard]] Result<> write(const nlohmann::json& figures,
                               const std::filesystem::path& path) const;

 private:
  void add_map(const style::Findings& findings);
  void add_cycles(const style::Findings& findings);
  void add_kernel(const style::Findings& findings);
  void add_strides(const style::Findings& findings);

  const std::vector<style::TrainingClip>& clips_;
  std::vector<report::Figure> styles_, cycles_, kernel_, strides_;
  Result<> drawn_;
};

}  // namespace posed::tools
