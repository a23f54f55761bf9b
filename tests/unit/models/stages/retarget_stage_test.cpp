// The retarget stage as the pipeline sees it: its skeletons, its files and its frames.
#include <catch2/catch.hpp>

#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/retarget/retarget_stage.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::retarget {
namespace {

const StageType& type() { return retarget_type(); }

StageContext context_to(const std::shared_ptr<const Skeleton>& skeleton, const std::string& to) {
  Parameters parameters{{"to", to}};
  REQUIRE(type().read_files(parameters));
  return {.skeleton = skeleton, .rate_hz = 30.0, .parameters = std::move(parameters)};
}

}  // namespace

TEST_CASE("the canonical skeleton stands where the person stands in T-pose") {
  const clip::Clip walk = motion::make_walker({.seconds = 1.0}).value();
  const auto canonical = motion::canonical_skeleton(*walk.skeleton).value();
  CHECK(canonical->joints[0].name == "hips");
  for (const Joint& joint : canonical->joints) {
    CHECK(joint.T_world_joint.isApprox(Eigen::Quaterniond::Identity()));
    CHECK(joint.bone.has_value());
  }
  // Of itself it is itself.
  const auto again = motion::canonical_skeleton(*canonical).value();
  REQUIRE(again->joints.size() == canonical->joints.size());
  for (std::size_t j = 0; j < again->joints.size(); ++j) {
    CHECK(again->joints[j].offset_m.isApprox(canonical->joints[j].offset_m));
  }
  Skeleton stick;
  stick.name = "stick";
  stick.joints.emplace_back().name = "end";
  const auto refused = motion::canonical_skeleton(stick);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("no hips") != std::string::npos);
}

TEST_CASE("frames leave the retarget stage on the skeleton that it announces") {
  const clip::Clip walk = motion::make_walker({.seconds = 1.0}).value();
  const StageContext context = context_to(walk.skeleton, "humanoid");
  const auto skeleton = type().leaves(context).value();
  const auto stage = type().make(context, nullptr).value();
  const Frame in = walk.frame(7);
  test::LastFrame out;
  stage->process({.frame = in, .input = &in}, out);
  CHECK(out.count == 1);
  CHECK(out.out.skeleton == skeleton->id);
  CHECK(out.out.joint_count == skeleton->joints.size());
  CHECK(out.out.header.sequence == in.header.sequence);
  // Every joint is where the source's is: the proportions are the same.
  const auto before = motion::world_pose(*walk.skeleton, in);
  const auto after = motion::world_pose(*skeleton, out.out);
  for (std::size_t j = 0; j < skeleton->joints.size(); ++j) {
    const auto from = static_cast<std::size_t>(walk.skeleton->joint_of(*skeleton->joints[j].bone));
    CHECK((after.position_m[j] - before.position_m[from]).norm() < 1e-5);
  }
}

TEST_CASE("a clip names the skeleton, and its parameter keeps all that is needed of it") {
  const clip::Clip walk = motion::make_walker({.seconds = 1.0}).value();
  const clip::Clip other =
      motion::make_walker({.family = motion::WalkerFamily::kSway, .person = 5, .seconds = 1.0})
          .value();
  const test::TempFolder folder;
  REQUIRE(clip::write_bvh(other, folder.path() / "other.bvh"));
  const clip::Clip read = clip::read_clip(folder.path() / "other.bvh").value();
  const StageContext context = context_to(walk.skeleton, folder.path() / "other.bvh");
  std::filesystem::remove(folder.path() / "other.bvh");
  const auto skeleton = type().leaves(context).value();
  CHECK(skeleton->id == read.skeleton->id);
  CHECK(type().make(context, nullptr));
  Parameters missing{{"to", std::string("nowhere.bvh")}};
  const auto refused = type().read_files(missing);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().text().find("nowhere.bvh") != std::string::npos);
}

}  // namespace posed::retarget
