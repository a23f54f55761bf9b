// posed_bench feet: what a frame costs the stages style and feet, on a body of 43 joints.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "models/feet/feet_stage.hpp"
#include "models/gp/synthetic.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/style_filter.hpp"
#include "proto/clip/clip.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"
#include "tests/support/processor_time.hpp"

namespace posed::bench {
namespace {

constexpr std::size_t kJoints = 43;
constexpr int kRounds = 20;

// A walker with as many joints more on the right hand as there are to be.
clip::Clip walker_of_many_joints() {
  clip::Clip walk = motion::make_walker({.seconds = 30.0, .rate_hz = 120.0}).value();
  auto skeleton = std::make_shared<Skeleton>(*walk.skeleton);
  int hand = skeleton->joint_index("RightHand");
  const auto after = skeleton->joints.begin() + hand + 1;
  const auto more = static_cast<std::ptrdiff_t>(kJoints - skeleton->joints.size());
  std::vector<Joint> fingers(static_cast<std::size_t>(more));
  for (std::size_t i = 0; i < fingers.size(); ++i) {
    fingers[i].name = "finger" + std::to_string(i);
    fingers[i].parent = hand;
    fingers[i].offset_m = {-0.02, 0.0, 0.0};
  }
  skeleton->joints.insert(after, fingers.begin(), fingers.end());
  for (Joint& joint : skeleton->joints) {
    if (joint.parent > hand) joint.parent += static_cast<int>(more);
  }
  for (Channel& channel : skeleton->channels) {
    if (channel.joint > hand) channel.joint += static_cast<std::uint16_t>(more);
  }
  skeleton->finish().value();
  walk.skeleton = std::move(skeleton);
  return walk;
}

class IntoFeet final : public StageOut {
 public:
  explicit IntoFeet(Stage& feet) : feet_(feet) {}
  void frame(const StageFrame& styled) noexcept override { feet_.process(styled, end_); }

 private:
  class End final : public StageOut {
   public:
    void frame(const StageFrame& done) noexcept override { last = done.frame; }
    Frame last;
  };
  Stage& feet_;
  End end_;
};

nlohmann::json measure(int points) {
  const clip::Clip walk = walker_of_many_joints();
  style::StyleModel model;
  model.space = motion::describe_space(motion::Space::kNative, *walk.skeleton).value();
  model.process = gp::synthetic(points, motion::space_dims(model.space)).process;
  const Eigen::VectorXd neutral = model.process.inputs.colwise().mean();
  model.gate = {.neutral = neutral, .swing_rad = 0.1, .fastest_stride_s = 1.0};
  model.axis = {.direction = neutral, .offset = 0.0};
  const auto bound = style::bind_model(model, *walk.skeleton, "synthetic").value();
  nlohmann::json report{{"joints", walk.skeleton->joints.size()}, {"points", points}};
  for (const char* root : {"off", "stride", "actor"}) {
    style::StyleFilter style(bound.get(), {});
    const auto parameters = complete_parameters(feet::feet_type().parameters, {{"root", root}});
    const auto feet = feet::feet_type()
                          .make({.skeleton = walk.skeleton,
                                 .rate_hz = walk.frame_rate_hz,
                                 .parameters = parameters.value()},
                                nullptr)
                          .value();
    IntoFeet out(*feet);
    std::vector<double> us;
    for (int round = 0; round < kRounds; ++round) {
      for (int t = 0; t < walk.frames(); ++t) {
        const Frame in = walk.frame(t);
        us.push_back(test::timed_us([&] { style.process({.frame = in, .input = &in}, out); }));
      }
    }
    report[root] = percentiles(us);
  }
  return report;
}

}  // namespace

void add_bench_feet(CLI::App& bench) {
  const auto points = std::make_shared<int>(200);
  CLI::App* command =
      bench.add_subcommand("feet", "Style and feet on a body of 43 joints, as JSON");
  command->add_option("--points", *points, "Poses in the style model")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command->callback([points] { std::printf("%s\n", measure(*points).dump(2).c_str()); });
}

}  // namespace posed::bench
