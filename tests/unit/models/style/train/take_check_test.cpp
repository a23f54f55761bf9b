// A take that was recorded live is refused, in words, where training would learn nothing good.
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/train/take_check.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/has.hpp"

namespace posed::style {
namespace {

using test::has;

constexpr double kRate_hz = 60.0;

// Twelve seconds of a walk, as clip::FramesClip makes it.
TrainingClip walked() {
  auto clip = motion::make_walker({.seconds = 12.0, .rate_hz = kRate_hz}).value();
  for (int i = 0; i < clip.frames(); ++i) clip.time_s.push_back(i / kRate_hz);
  return {.clip = std::move(clip), .group = "as usual", .subject = "ann", .motion = "walk"};
}

// Stands from one time to another; only the arms move on where they `wave`.
void stand(clip::Clip& clip, double from_s, double to_s, bool wave = false) {
  const auto first = static_cast<Eigen::Index>(from_s * kRate_hz);
  const Eigen::RowVectorXd pose = clip.channels.row(first);
  for (Eigen::Index i = first; i < static_cast<Eigen::Index>(to_s * kRate_hz); ++i) {
    for (Eigen::Index c = 0; c < clip.channels.cols(); ++c) {
      const Channel& channel = clip.skeleton->channels[static_cast<std::size_t>(c)];
      const bool arm = has(clip.skeleton->joints[channel.joint].name, "Arm");
      if (!(wave && arm) && !channel.translation) clip.channels(i, c) = pose[c];
    }
  }
}

// The same walk on a circle: it turns once in ten seconds.
void walk_in_a_circle(clip::Clip& clip) {
  clip::FramesClip circle(clip.skeleton);
  Eigen::Vector3d before = Eigen::Vector3d::Zero(), at = before;
  for (int i = 0; i < clip.frames(); ++i) {
    Frame frame = clip.frame(i);
    const auto turn = axis_rotation(Axis::kY, 0.2 * std::numbers::pi * i / kRate_hz);
    auto root = Eigen::Map<Eigen::Vector3f>(frame.root_position_m.data());
    const Eigen::Vector3d now = root.cast<double>();
    at += turn * (now - std::exchange(before, now));
    root = at.cast<float>();
    frame.angle_count = 0;
    frame.rotation_xyzw[0] = from_eigen(turn * to_eigen_double(frame.rotation_xyzw[0]));
    circle.add(frame);
  }
  clip.channels = circle.finish("circle", kRate_hz, clip.time_s).value().channels;
}

std::string refusal(TrainingClip take) { return check_take(take, 30.0).problem; }

}  // namespace

TEST_CASE("a live walk is told by its strides, without its standing", "[take_check]") {
  TrainingClip take = walked();
  const TakeCheck whole = check_take(take, 30.0);
  REQUIRE(whole.problem.empty());
  CHECK(whole.strides >= 9);
  CHECK(whole.strides <= 12);
  CHECK(whole.standing_s < 0.5);
  stand(take.clip, 0.0, 3.0);
  const TakeCheck late = check_take(take, 30.0);
  INFO(late.sentence());
  REQUIRE(late.good());
  CHECK(late.standing_s > 1.5);
  CHECK(late.strides < whole.strides);
  CHECK(has(late.sentence(), "strides in 12.0 s; ... s of standing are left out"));
}

TEST_CASE("who stands in T-pose for longer than he walks teaches his walk alone", "[take_check]") {
  TrainingClip take = walked();
  stand(take.clip, 0.0, 6.5);
  const auto standing = static_cast<Eigen::Index>(6.5 * kRate_hz);
  for (Eigen::Index c = 0; c < take.clip.channels.cols(); ++c) {
    const Channel& channel = take.clip.skeleton->channels[static_cast<std::size_t>(c)];
    if (has(take.clip.skeleton->joints[channel.joint].name, "UpperArm")) {
      take.clip.channels.col(c).head(standing).array() += 2.0F;
    }
  }
  const TakeCheck checked = check_take(take, 30.0);
  INFO(checked.sentence());
  REQUIRE(checked.good());
  CHECK(checked.standing_s > 6.0);
  DatasetOptions options;
  options.space = motion::Space::kHumanoid;
  const auto dataset = make_dataset({take}, {}, options).value();
  REQUIRE(dataset.clips[0].mended.size() == 1);
  CHECK(has(dataset.clips[0].mended[0], "6.5 s of standing before the walk are left out"));
}

TEST_CASE("a walk whose body jumps, or that begins or ends in silence, is refused",
          "[take_check]") {
  TrainingClip take = walked();
  CHECK(has(check_take(take, 30.0, 0.6).problem, "silent for 0.6 s"));
  for (Eigen::Index c = 0; c < take.clip.channels.cols(); ++c) {
    if (take.clip.skeleton->channels[static_cast<std::size_t>(c)].translation) {
      take.clip.channels.col(c).tail(300).array() += 10.0;
    }
  }
  CHECK(has(refusal(take), "jumped by 17.3 m"));
}

TEST_CASE("a live walk whose feet were captured badly says so", "[take_check]") {
  const TrainingClip good = walked();
  const auto is_root = [&](const Channel& channel, Axis axis) {
    return channel.translation && channel.joint == 0 && channel.axis == axis;
  };
  const auto change = [&](const auto& value) {
    TrainingClip take = good;
    for (Eigen::Index c = 0; c < take.clip.channels.cols(); ++c) {
      value(take.clip.skeleton->channels[static_cast<std::size_t>(c)], take.clip.channels.col(c));
    }
    return check_take(take, 30.0);
  };
  CHECK(change([](const Channel&, auto) {}).feet.empty());
  const TakeCheck slides = change([&](const Channel& channel, auto values) {
    if (is_root(channel, Axis::kZ)) values *= 0.4;
  });
  INFO(slides.sentence());
  CHECK(slides.good());
  CHECK(has(slides.sentence(), "standing feet slide at"));
  const TakeCheck treadmill = change([&](const Channel& channel, auto values) {
    if (is_root(channel, Axis::kZ)) values.setZero();
  });
  CHECK(treadmill.feet.empty());
  const TakeCheck uneven = change([&](const Channel& channel, auto values) {
    if (is_root(channel, Axis::kY)) {
      values += Eigen::VectorXd::LinSpaced(values.rows(), 0.0, 0.2);
    }
  });
  INFO(uneven.sentence());
  CHECK(has(uneven.sentence(), "the floor under the feet differs by 1"));
  const TakeCheck hangs = change([&](const Channel& channel, auto values) {
    const std::string& name = good.clip.skeleton->joints[channel.joint].name;
    if (has(name, "Left") && (has(name, "Leg") || has(name, "Foot"))) values.setConstant(values[0]);
  });
  CHECK(has(hangs.problem, "the left foot hardly moved"));
}

TEST_CASE("a walk about the stage is learnt from as one that goes straight on", "[take_check]") {
  TrainingClip straight = walked();
  TrainingClip circle = straight;
  walk_in_a_circle(circle.clip);
  const clip::ChannelMatrix untouched = straight.clip.channels;
  REQUIRE(check_take(straight, 30.0).good());
  CHECK(straight.clip.channels == untouched);
  const TakeCheck checked = check_take(circle, 30.0);
  INFO(checked.sentence());
  REQUIRE(checked.good());
  DatasetOptions options;
  options.space = motion::Space::kHumanoid;
  const auto dataset = make_dataset({straight, circle}, {}, options).value();
  const Eigen::MatrixXd& a = dataset.clips[0].q;
  const Eigen::MatrixXd& b = dataset.clips[1].q;
  REQUIRE(a.rows() == b.rows());
  CHECK(std::sqrt((a - b).squaredNorm() / static_cast<double>(a.rows())) < 5.0 * kDegree);
  CHECK((dataset.clips[0].root - dataset.clips[1].root).cwiseAbs().maxCoeff() < 0.3);
}

TEST_CASE("spoilt takes are refused with a reason", "[take_check]") {
  TrainingClip take = walked();
  stand(take.clip, 0.0, 12.0);
  CHECK(has(refusal(take), "no walk ... keep walking"));

  take = walked();
  stand(take.clip, 0.0, 12.0, true);
  CHECK(has(refusal(take), "no walk, because the legs swing by 0"));

  take = walked();  // one stride, then he stands
  stand(take.clip, 1.2, 12.0);
  CHECK_FALSE(refusal(take).empty());

  take = walked();
  stand(take.clip, 4.0, 12.0);
  CHECK(has(refusal(take), "heard in 12.0 s, and 4 are needed: walk longer"));

  take = walked();  // a dropout
  take.clip.time_s.back() += 0.8;
  CHECK(has(refusal(take), "silent for 0.8 s"));

  take = walked();
  take.clip.channels.resize(0, take.clip.channels.cols());
  take.clip.time_s.clear();
  CHECK(has(refusal(take), "no frames came"));
}

TEST_CASE("a joint that is missing for long spoils a take, one for a moment does not",
          "[take_check]") {
  TrainingClip take = walked();
  const auto c = static_cast<Eigen::Index>(take.clip.skeleton->channels.size()) - 1;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  take.clip.channels.col(c).segment(100, 20).setConstant(kNone);
  TrainingClip held = take;
  const TakeCheck checked = check_take(held, 30.0);
  CHECK(checked.good());
  CHECK(has(checked.sentence(), "missing: RightToes (3 %)"));
  CHECK(held.clip.channels.allFinite());
  take.clip.channels.col(c).segment(100, 200).setConstant(kNone);
  CHECK(has(refusal(take), "RightToes was missing in 28 % of the frames"));
}

}  // namespace posed::style
