// The gesture model's parse_model on any bytes, as a file and as the payload of a right header.
// Every tree of an accepted model is searched, and no lookup may leave its tree; the model
// performs, live and at once, and smooths.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "models/gesture/model_file.hpp"
#include "models/gesture/tree_drawing.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/label_sequence_player.hpp"
#include "models/perform/perform.hpp"
#include "models/smooth/live_smoother.hpp"
#include "models/trajectory/state_information.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/fuzz/demand.hpp"
#include "tests/fuzz/model_envelope.hpp"
#include "tests/fuzz/walker.hpp"

namespace {

using namespace posed;
using namespace posed::gesture;
using posed::fuzz::demand;

constexpr int kWalkedLabels = 4;  // of each position; more would cost time and find nothing new

void walk_all(const GestureModel& model) {
  const int labels = std::min(kWalkedLabels, static_cast<int>(model.labels.size()));
  for (int number = 0; number < labels * labels * labels; ++number) {
    const Context context{number % labels, number / labels % labels, number / labels / labels};
    double sum = duration(model, context).mean[0];
    for (int state = 0; state < kStates; ++state) {
      for (int group = 0; group < std::ssize(model.groups); ++group) {
        sum += leaf(model, state, group, context).mean[0][0];
      }
    }
    demand(sum < 1e300);
  }
}

constexpr int kFrames = 30;  // of what a model performs and smooths here

// One label at once, if that is short, and all of them as a stream.
void perform_all(const GestureModel& model) {
  const trajectory::StateInformation information(std::make_shared<const GestureModel>(model),
                                                 model.rate_hz);
  perform::LabelSequencePlayer player(information, {.look_ahead_s = 1.0 / model.rate_hz});
  for (int label = 0; label < std::ssize(model.labels); ++label) {
    static_cast<void>(player.add(label));
  }
  player.start();
  perform::PlayedFrame played;
  for (int t = 0; t < kFrames && player.next(played); ++t) demand(played.label >= 0);
  constexpr double kShort = 1'000.0;  // frames
  double frames = 0.0;
  for (const double state : duration(model, {0, 0, 0}).mean) frames += state;
  if (frames > kShort) return;
  const auto performance = perform::perform(information, std::array{0}, {});
  if (!performance || model.is_hand()) return;
  const auto body = perform::perform_on(model, *performance, fuzz::walker(1));
  demand(!body || body->clip.frames() == std::ssize(performance->angles));
}

class Count final : public StageOut {
 public:
  void frame(const StageFrame& frame) noexcept override {
    for (std::size_t j = 0; j < frame.frame.joint_count; ++j) {
      demand(!frame.frame.valid[j] || std::isfinite(frame.frame.rotation_xyzw[j][3]));
    }
    ++frames;
  }
  int frames = 0;
};

// A walker, or a hand that closes, in the middle of which nothing is measured.
void smooth_all(const GestureModel& model) {
  const clip::Clip walk = fuzz::walker(kFrames);
  const Skeleton skeleton = model.is_hand() ? hand_skeleton(Side::kRight) : *walk.skeleton;
  const auto live = smooth::bind_live_model(model, skeleton, "fuzz");
  if (!live) return;
  smooth::LiveSmoother smoother(skeleton, {}, live->get());
  Count out;
  for (int t = 0; t < kFrames; ++t) {
    Frame frame = walk.frame(t);
    if (model.is_hand()) {
      HandAngles angles;
      angles.fill(t / 10 == 1 ? std::numeric_limits<double>::quiet_NaN() : 0.03 * t);
      frame = {};
      set_hand_angles(skeleton, angles, frame);
    }
    frame.header.sequence = static_cast<std::uint64_t>(t) + 1;
    frame.header.device_ns = t * 33'000'000;
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  demand(out.frames == kFrames);
}

void try_bytes(const std::string& bytes) {
  const auto model = parse_model(std::as_bytes(std::span(bytes)), "fuzz");
  if (!model) return;
  walk_all(*model);
  static_cast<void>(trees_dot(*model, {}));
  perform_all(*model);
  smooth_all(*model);
  // An accepted model can be written and read back with the same bytes.
  const std::string written = serialize_model(*model);
  const auto again = parse_model(std::as_bytes(std::span(written)), "fuzz");
  demand(again && serialize_model(*again) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  try_bytes(input);
  try_bytes(posed::fuzz::as_model_file(input));
  return 0;
}
