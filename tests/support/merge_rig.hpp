// A merge stage in the place of the pipeline: bodies and gloves whose motion is known at any time,
// and the order of their frames as the test says.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "models/merge/hand_map.hpp"
#include "models/merge/merge_stage.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/ms.hpp"

namespace posed::test {

inline std::shared_ptr<const Skeleton> glove_skeleton(Side side) {
  return std::make_shared<const Skeleton>(hand_skeleton(side));
}

// A body without fingers, whose joints have channels.
inline std::shared_ptr<const Skeleton> walker_skeleton() {
  return motion::make_walker({.seconds = 0.1}).value().skeleton;
}

// The walker with a left and a right glove (null: none) and these parameters, in people's names
// less their units.
inline StageContext merge_context(std::shared_ptr<const Skeleton> body,
                                  std::shared_ptr<const Skeleton> left,
                                  std::shared_ptr<const Skeleton> right = nullptr,
                                  Parameters changed = {}) {
  if (left) changed["left"] = std::string("glove-l");
  if (right) changed["right"] = std::string("glove-r");
  return {.skeleton = std::move(body),
          .rate_hz = 120.0,
          .parameters = complete_parameters(merge::merge_type().parameters, changed).value(),
          .partners = {{.skeleton = std::move(left), .rate_hz = 100.0},
                       {.skeleton = std::move(right), .rate_hz = 100.0}}};
}

// All fingers bent by so much, as a glove measures it.
inline Frame glove_frame(const Skeleton& glove, double bent_rad, std::int64_t arrival_ns) {
  HandAngles angles{};
  for (std::size_t joint = 0; joint < kHandJoints; ++joint) angles[3 * joint] = bent_rad;
  Frame frame;
  set_hand_angles(glove, angles, frame);
  frame.header.arrival_ns = arrival_ns;
  return frame;
}

inline Frame body_frame(const Skeleton& body, std::uint64_t sequence, std::int64_t arrival_ns) {
  Frame frame;
  const std::vector<double> zeros(body.channels.size(), 0.0);
  pose_from_channels(body, zeros, frame);
  frame.header.sequence = sequence;
  frame.header.arrival_ns = arrival_ns;
  return frame;
}

// How far a joint of the hand is bent in a frame of the merged skeleton [rad], whatever its axes.
inline double bent_rad(const Skeleton& merged, Side side, int finger_joint, const Frame& frame) {
  const auto map = merge::HandMap::bind("merged", side, merged, merged, merge::Wrist::kBody);
  REQUIRE(map);
  const merge::HandPose pose = map->read(frame);
  return rotation_log(pose.turn[static_cast<std::size_t>(finger_joint)]).norm();
}

// Runs one stage, and ticks it when it asks for that before the next call.
class MergeRig final : private StageOut {
 public:
  struct Out {
    Frame frame;
    std::int64_t at_ns;  // when it left
  };

  explicit MergeRig(const StageContext& context)
      : skeleton(merge::merge_type().leaves(context).value()),
        stage_(merge::merge_type().make(context, nullptr).value()) {}

  void body(const Frame& frame) {
    until(frame.header.arrival_ns);
    stage_->process({.frame = frame, .input = &frame}, *this);
  }
  void glove(std::size_t partner, const Frame& frame) {
    until(frame.header.arrival_ns);
    stage_->partner(partner, {.frame = frame}, *this);
  }
  // Time passes: ticks at the very time at which they are due.
  void until(std::int64_t now_ns) {
    for (std::int64_t due_ns = stage_->next_due_ns(); due_ns != kNoTime_ns && due_ns <= now_ns;
         due_ns = stage_->next_due_ns()) {
      now_ns_ = due_ns;
      stage_->tick(due_ns, *this);
    }
    now_ns_ = now_ns;
  }
  void flush() { stage_->flush(*this); }

  std::shared_ptr<const Skeleton> skeleton;  // of what leaves
  std::vector<Out> out;
  std::function<void(const Out&)> each;  // instead of `out`, if it is there

 private:
  void frame(const StageFrame& made) noexcept override {
    CHECK(made.input == &made.frame);  // what it is before a style
    if (each) return each({made.frame, now_ns_});
    out.push_back({made.frame, now_ns_});
  }

  std::unique_ptr<Stage> stage_;
  std::int64_t now_ns_ = 0;
};

}  // namespace posed::test
