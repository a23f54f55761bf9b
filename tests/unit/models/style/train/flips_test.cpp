// Joints that flip for a moment are mended, those that stay flipped are left out, and either is
// said.
#include "models/style/train/flips.hpp"

#include <catch2/catch.hpp>

#include <cmath>

#include "models/motion/motion.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/rotation.hpp"

using namespace posed;
using namespace posed::motion;

namespace {

constexpr Eigen::Index kFrames = 90;

struct Poses {
  PoseSpaceSpec spec;
  PoseSpace space;
  Eigen::MatrixXd q;

  // The first dimension of a joint.
  [[nodiscard]] Eigen::Index at(const std::string& joint) const {
    for (std::size_t i = 0; i < spec.joints.size(); ++i) {
      if (spec.joints[i] == joint) return static_cast<Eigen::Index>(3 * i);
    }
    FAIL("no joint " << joint);
    return -1;
  }

  void flip(const std::string& joint, Eigen::Index begin, Eigen::Index end) {
    for (Eigen::Index t = begin; t < end; ++t) q(t, at(joint)) += 3.0;
  }
};

Poses small_swings() {
  const auto clip = make_walker({.seconds = 1.0});
  REQUIRE(clip.has_value());
  auto spec = describe_space(Space::kHumanoid, *clip->skeleton).value();
  auto space = PoseSpace::bind(spec, *clip->skeleton).value();
  Eigen::MatrixXd q(kFrames, space.dims());
  for (Eigen::Index t = 0; t < q.rows(); ++t) {
    for (Eigen::Index d = 0; d < q.cols(); ++d) {
      q(t, d) = 0.1 * std::sin(0.2 * static_cast<double>(t) + static_cast<double>(d));
    }
  }
  return {std::move(spec), std::move(space), std::move(q)};
}

}  // namespace

TEST_CASE("A joint that flips for a moment is filled in and named", "[flips]") {
  Poses poses = small_swings();
  const Eigen::MatrixXd right = poses.q;
  poses.flip("leftHand", 40, 44);
  poses.flip("rightUpperLeg", 86, kFrames);  // up to the end
  const auto mended = style::mend_flips(poses.spec, poses.space, 30.0, poses.q);
  REQUIRE(mended.has_value());
  REQUIRE(mended->size() == 2);
  CHECK((poses.q - right).cwiseAbs().maxCoeff() < 0.1);
  const std::string all = (*mended)[0] + (*mended)[1];
  CHECK(all.find("leftHand flips by 17") != std::string::npos);
  CHECK(all.find("at frame 41") != std::string::npos);
  CHECK(all.find("4 frames") != std::string::npos);
  // What does not flip keeps its bits.
  CHECK((poses.q.leftCols(3).array() == right.leftCols(3).array()).all());
  CHECK(style::mend_flips(poses.spec, poses.space, 30.0, poses.q)->empty());
}

TEST_CASE("A joint that stays flipped is left out, or refuses the clip by name", "[flips]") {
  Poses poses = small_swings();
  poses.flip("leftHand", 40, 70);
  const auto mended = style::mend_flips(poses.spec, poses.space, 30.0, poses.q);
  REQUIRE(mended.has_value());
  REQUIRE(mended->size() == 1);
  CHECK(mended->front().find("left out") != std::string::npos);
  CHECK(poses.q.col(poses.at("leftHand")).maxCoeff() < 0.11);

  Poses legs = small_swings();
  legs.flip("rightUpperLeg", 40, 70);
  const auto refused = style::mend_flips(legs.spec, legs.space, 30.0, legs.q);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("rightUpperLeg") != std::string::npos);
}
