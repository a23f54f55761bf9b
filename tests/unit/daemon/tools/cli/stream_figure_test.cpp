// The figure of a stream, made of what a daemon sends: whole, of another stream, or damaged.
#include "daemon/tools/live/chosen_stream.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/skeleton_message.hpp"

namespace posed::tools {
namespace {

class FigureRig {
 public:
  FigureRig() {
    skeleton = message::skeleton_message("walker", *walk.skeleton, 60.0);
    const Frame frame = walk.frame(7);
    pose.set_stream("walker");
    pose.set_skeleton_id(skeleton.id());
    for (std::size_t j = 0; j < walk.skeleton->joints.size(); ++j) {
      for (const float value : frame.rotation_xyzw[j]) pose.add_rotation_xyzw(value);
      pose.mutable_validity()->push_back('\1');
    }
    for (const float value : frame.root_position_m) pose.add_root_position_m(value);
  }

  template <typename Message>
  void send(const std::string& topic, const Message& message) {
    const std::string text = message.SerializeAsString();
    figure.handle(topic, std::as_bytes(std::span(text)));
  }
  bool is_drawn() { return !figure.lines(20, 8).empty(); }

  clip::Clip walk = motion::make_walker({.seconds = 1.0}).value();
  v1::Skeleton skeleton;
  v1::Frame pose;
  StreamFigure figure{"walker"};
};

TEST_CASE("a stream's figure needs its skeleton and a pose of it", "[stream_figure]") {
  FigureRig rig;
  rig.send("pose/walker", rig.pose);
  CHECK_FALSE(rig.is_drawn());
  rig.send("skeleton/another", rig.skeleton);
  rig.send("pose/walker", rig.pose);
  CHECK_FALSE(rig.is_drawn());
  rig.send("skeleton/walker", rig.skeleton);
  CHECK_FALSE(rig.is_drawn());
  rig.send("pose/walker-raw", rig.pose);
  CHECK_FALSE(rig.is_drawn());
  rig.send("pose/walker", rig.pose);
  CHECK(rig.is_drawn());
  const auto lines = rig.figure.lines(20, 8);
  CHECK(lines.size() == 8);
  CHECK(lines != std::vector<std::string>(8, std::string(20, ' ')));
  rig.skeleton.set_id(rig.skeleton.id() + 1);  // a new one: its poses are awaited
  rig.send("skeleton/walker", rig.skeleton);
  CHECK_FALSE(rig.is_drawn());
}

TEST_CASE("a stream's figure does not take damaged poses", "[stream_figure]") {
  FigureRig rig;
  rig.send("skeleton/walker", rig.skeleton);
  const auto refuses = [&](auto damage) {
    v1::Frame pose = rig.pose;
    damage(pose);
    rig.send("pose/walker", pose);
    return !rig.is_drawn();
  };
  CHECK(refuses([](v1::Frame& pose) { pose.set_skeleton_id(1); }));
  CHECK(refuses([](v1::Frame& pose) { pose.add_rotation_xyzw(0.0F); }));
  CHECK(refuses([](v1::Frame& pose) { pose.clear_validity(); }));
  CHECK(refuses([](v1::Frame& pose) { pose.clear_root_position_m(); }));
  CHECK(refuses([](v1::Frame& pose) {
    pose.set_root_position_m(0, std::numeric_limits<float>::quiet_NaN());
  }));
  rig.figure.handle("pose/walker", std::as_bytes(std::span("\xff\xff")));
  CHECK_FALSE(rig.is_drawn());
  // A joint that is no rotation counts as not measured; the rest of the pose is drawn.
  for (const float value : {1e30F, 0.0F, std::numeric_limits<float>::infinity()}) {
    v1::Frame pose = rig.pose;
    for (int i = 0; i < 4; ++i) pose.set_rotation_xyzw(i, value);
    rig.send("pose/walker", pose);
    CHECK(rig.figure.lines(20, 8) != std::vector<std::string>(8, std::string(20, ' ')));
  }
}

TEST_CASE("a stream's figure keeps its size while the pose changes", "[stream_figure]") {
  FigureRig rig;
  rig.send("skeleton/walker", rig.skeleton);
  rig.send("pose/walker", rig.pose);
  const auto standing = rig.figure.lines(20, 8);
  v1::Frame lying = rig.pose;  // turned by 90 degrees about Z
  const float half = std::sqrt(0.5F);
  for (const int i : {0, 1, 2, 3}) lying.set_rotation_xyzw(i, i < 2 ? 0.0F : half);
  rig.send("pose/walker", lying);
  CHECK(rig.figure.lines(20, 8).front() == std::string(20, ' '));  // the head is down
  rig.send("pose/walker", rig.pose);
  for (int i = 0; i < 500; ++i) static_cast<void>(rig.figure.lines(20, 8));
  CHECK(rig.figure.lines(20, 8) == standing);  // the width of lying is forgotten
}

}  // namespace
}  // namespace posed::tools
