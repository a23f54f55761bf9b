#include "models/retarget/retarget_stage.hpp"

#include <string>
#include <string_view>
#include <utility>

#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/retarget.hpp"
#include "proto/clip/device_clip.hpp"

namespace posed::retarget {
namespace {

constexpr std::string_view kHumanoid = "humanoid";

class RetargetStage final : public Stage {
 public:
  explicit RetargetStage(motion::Retarget retarget) : retarget_(std::move(retarget)) {}

  // The variance of the pose is not carried over: it belongs to the source's channels.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override {
    retarget_.apply(in.frame, frame_);
    out.frame({.frame = frame_, .variance_rad2 = {}, .input = in.input});
  }

 private:
  motion::Retarget retarget_;
  Frame frame_;  // the last one: the next one's angles stay near to it
};

Result<std::shared_ptr<const Skeleton>> target(const StageContext& context) {
  const auto& to = parameter<std::string>(context.parameters, "to");
  if (to == kHumanoid) return motion::canonical_skeleton(*context.skeleton);
  auto coding = TRY(clip::parse_description(to, "the skeleton to retarget to"));
  return std::move(coding.skeleton);
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* /*model*/) {
  auto skeleton = TRY(target(context));
  auto retarget = TRY(motion::Retarget::bind(context.skeleton, std::move(skeleton)));
  return std::make_unique<RetargetStage>(std::move(retarget));
}

// Of a clip only the skeleton is kept, in the text form that a device log has for it, too.
Result<> read_target(Parameters& parameters) {
  auto& to = std::get<std::string>(parameters.at("to"));
  if (to == kHumanoid) return {};
  const auto clip = TRY(clip::open_device_clip(to));
  to = clip.description;
  return {};
}

std::vector<ParameterSpec> parameters() {
  return {{.name = "to",
           .default_value = std::string(kHumanoid),
           .is_path = true,
           .help = "humanoid: VRM bones without axes of their own; or a clip or an avatar "
                   "(.vrm) whose skeleton is wanted"}};
}

}  // namespace

const StageType& retarget_type() {
  static const StageType type{.name = "retarget",
                              .summary = "puts the pose on another skeleton",
                              .parameters = parameters(),
                              .input = StageInput::kLoses,
                              .read_files = read_target,
                              .leaves = target,
                              .make = make};
  return type;
}

}  // namespace posed::retarget
