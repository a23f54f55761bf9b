// posed apply: a clip through the style stage, into a BVH.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/degrees.hpp"
#include "daemon/cli/progress.hpp"
#include "models/style/apply.hpp"
#include "proto/clip/clip.hpp"

namespace posed::cli {
namespace {

constexpr int kLongClip = 20'000;  // frames from which on waiting is felt

struct Options {
  std::filesystem::path model, in, out;
  clip::ReadOptions read;
  style::ApplyOptions apply;
  bool json = false;
};

Result<> run(Options options) {
  const auto model = style::load_model(options.model);
  if (!model) return std::unexpected(model.error());
  const auto clip = clip::read_clip(options.in, options.read);
  if (!clip) return std::unexpected(clip.error());
  for (const std::string& warning : clip->warnings) {
    std::fprintf(stderr, "posed: %s: %s\n", options.in.c_str(), warning.c_str());
  }
  std::unique_ptr<ProgressBar> bar;
  if (clip->frames() >= kLongClip) {
    bar = std::make_unique<ProgressBar>();
    options.apply.progress = [&bar](int done, int total) {
      return bar->show("styling", static_cast<double>(done) / total);
    };
  }
  const auto applied = style::apply_to_clip(*model, options.model.string(), *clip, options.apply);
  bar.reset();
  if (!applied) return std::unexpected(applied.error());
  if (auto written = clip::write_bvh(applied->clip, options.out); !written) return written;

  const double rms_deg = applied->rms_change_rad * kDegrees;
  const double max_deg = applied->max_change_rad * kDegrees;
  if (options.json) {
    const nlohmann::json report{{"out", options.out.string()},
                                {"frames", clip->frames()},
                                {"rate_hz", clip->frame_rate_hz},
                                {"from", model->from},
                                {"to", model->to},
                                {"alpha", options.apply.filter.alpha},
                                {"cold", options.apply.cold},
                                {"joints_changed", applied->joints_changed},
                                {"rms_change_deg", rms_deg},
                                {"max_change_deg", max_deg}};
    std::printf("%s\n", report.dump(2).c_str());
  } else {
    std::printf("%s: %d frames, %d joints changed by %.1f deg rms, %.1f at most\n",
                options.out.c_str(), clip->frames(), applied->joints_changed, rms_deg, max_deg);
  }
  return {};
}

}  // namespace

void add_apply(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("apply", "Style a recorded clip: the code of the live filter");
  auto options = std::make_shared<Options>();
  style::FilterOptions& filter = options->apply.filter;
  command->add_option("--model", options->model, "What `posed train style` wrote")
      ->required()
      ->type_name("FILE.style");
  command->add_option("in", options->in, "The clip: .bvh or .amc")->required()->type_name("IN");
  command->add_option("--out", options->out, "The BVH to write")->required()->type_name("OUT.bvh");
  command->add_option("--alpha", filter.alpha, "How much: 0 none, 1 the target, negative away")
      ->check(CLI::Range(-style::kMaxAlpha, style::kMaxAlpha))
      ->capture_default_str();
  command->add_option("--skeleton", options->read.asf, "NN.asf of an AMC (default: beside it)")
      ->type_name("NN.asf");
  command->add_flag("--cold", options->apply.cold, "Start as a live stream starts");
  command->add_flag("--gate", filter.gate, "Fade to the mean change where the model knows nothing");
  command->add_flag("--calibrate", filter.calibrate, "Learn the walker's own carriage first");
  command->add_flag("--json", options->json, "Summary as one JSON object on stdout");
  command->footer(R"(Examples:
  posed apply --model walk.style walk_03.bvh --out styled.bvh
  posed apply --model walk.style --alpha 0.5 07_01.amc --skeleton 07.asf --out half.bvh
  posed apply --model walk.style --cold walk_03.bvh --out live.bvh   # as the daemon would have
OUT keeps the input's joints, channels, frame count and rate; an AMC becomes a BVH with Z, Y, X
rotations. Without --cold the style is there in full from the first frame.)");
  command->callback([options, &exit_code] {
    if (auto done = run(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
