#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "models/style/apply.hpp"
#include "models/style/evaluate.hpp"
#include "models/style/style_model.hpp"
#include "proto/clip/clip.hpp"

namespace posed::cli {
namespace {

using nlohmann::json;

constexpr const char* kEvalFooter = R"(Examples:
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh --json

The source goes through the same stage as live. cycle_ratio: how far the styled walk's average cycle
is from the target's, over how far the unstyled one was (0 is the target, 1 is no change); ratio:
the same frame by frame; jerk_ratio: roughness of the styled walk over the unstyled one's.)";

struct EvalOptions {
  std::string model, source, target, skeleton;
  double alpha = 1.0;
  bool json = false;
};

Result<clip::Clip> read(const std::string& path, const std::string& skeleton) {
  clip::ReadOptions options;
  if (path.ends_with(".amc")) options.asf = skeleton;
  return clip::read_clip(path, options);
}

Result<json> evaluate(const EvalOptions& options) {
  const auto model = style::load_model(options.model);
  if (!model) return std::unexpected(model.error());
  const auto source = read(options.source, options.skeleton);
  if (!source) return std::unexpected(source.error());
  const auto target = read(options.target, options.skeleton);
  if (!target) return std::unexpected(target.error());
  style::ApplyOptions apply;
  apply.filter.alpha = options.alpha;
  const auto styled = style::apply_to_clip(*model, options.model, *source, apply);
  if (!styled) return std::unexpected(styled.error());
  const auto score = style::evaluate_style(*source, styled->clip, *target);
  if (!score) return std::unexpected(score.error());
  return json{
      {"cycle_ratio", score->cycle_ratio},         {"ratio", score->ratio},
      {"jerk_ratio", score->jerk_ratio},           {"moved_rms_deg", score->moved_rms_deg},
      {"source_rms_deg", score->source_rms_deg},   {"source_period_s", score->source_period_s},
      {"target_period_s", score->target_period_s}, {"alpha", options.alpha}};
}

}  // namespace

void add_eval(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("eval", "Judge a model on clips");
  command->require_subcommand(1);
  add_eval_gesture(*command, exit_code);
  CLI::App* style = command->add_subcommand("style", "How near a styled clip comes to the target");
  style->footer(kEvalFooter);
  const auto options = std::make_shared<EvalOptions>();
  style->add_option("--model", options->model, "Model from `posed train style`")->required();
  style->add_option("--source", options->source, "Clip to be styled")->required();
  style->add_option("--target", options->target, "Clip of the style wanted")->required();
  style->add_option("--skeleton", options->skeleton, "NN.asf of AMC clips, if not beside them");
  style->add_option("--alpha", options->alpha, "How much style")
      ->check(CLI::Range(-2.0, 2.0))
      ->capture_default_str();
  style->add_flag("--json", options->json, "One JSON object on stdout");
  style->callback([options, &exit_code] {
    const auto score = evaluate(*options);
    if (!score) {
      exit_code = report(score.error());
    } else if (options->json) {
      std::printf("%s\n", score->dump(2).c_str());
    } else {
      for (const auto& [name, value] : score->items()) {
        std::printf("%-16s %8.3f\n", name.c_str(), value.get<double>());
      }
    }
  });
}

}  // namespace posed::cli
