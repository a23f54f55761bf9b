// A walk goes out of the emulator of each mocap system and in through its driver: every bone that
// the format carries comes back as it was, and is styled as the same walk from a file.
#include <catch2/catch.hpp>

#include <array>
#include <bitset>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/train/train.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/tools/emulate/heard_walk.hpp"

namespace posed::emulate {
namespace {

using motion::WalkerFamily;
using test::ReceivedPose;

constexpr double kWithin_rad = 0.1 * kDegree;
constexpr double kLacking_rad = 5.0 * kDegree;
constexpr std::int64_t kLength_ns = 2 * kNanosPerSecond;

// Rotation of each bone in the world relative to its T-pose.
struct Turns {
  Turns(const Skeleton& skeleton, const Frame& frame) {
    const motion::WorldPose pose = motion::world_pose(skeleton, frame);
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      const Joint& joint = skeleton.joints[j];
      if (!joint.bone) continue;
      const auto bone = static_cast<std::size_t>(*joint.bone);
      turn[bone] = pose.rotation[j] * joint.T_world_joint.conjugate();
      there[bone] = frame.valid[j];
    }
  }
  std::array<Eigen::Quaterniond, kBones> turn;
  std::bitset<kBones> there;
};

// Of the bones that both have.
struct Difference {
  void add(const Turns& a, const Turns& b) {
    for (std::size_t bone = 0; bone < kBones; ++bone) {
      if (!a.there[bone] || !b.there[bone]) continue;
      const double off_rad = angle_between_rad(a.turn[bone], b.turn[bone]);
      most_rad = std::max(most_rad, off_rad);
      squares += off_rad * off_rad;
      ++count;
    }
  }
  [[nodiscard]] double rms_rad() const { return std::sqrt(squares / count); }
  double most_rad = 0.0, squares = 0.0;
  int count = 0;
};

// A walk in a file of its own, and the walker that the drivers deliver.
class Walk {
 public:
  explicit Walk(const clip::Clip& walk) {
    REQUIRE(clip::write_bvh(walk, path()));
    clip_ = clip::read_clip(path()).value();
  }

  // The frames of the first person, with a time for the filter.
  [[nodiscard]] std::vector<ReceivedPose> through(const drivers::Driver& driver) const {
    std::vector<ReceivedPose> all = test::receive_walk(driver, {path()}, kLength_ns);
    std::erase_if(all, [](const ReceivedPose& received) {  // props
      return Turns(*received.skeleton, received.frame).there.count() < 5;
    });
    const std::string first = all.empty() ? "" : all[0].body;
    std::erase_if(all, [&](const ReceivedPose& received) { return received.body != first; });
    for (ReceivedPose& received : all) {
      received.frame.header.device_ns = kNoTime_ns;
      received.frame.header.arrival_ns = received.posed_ns;
    }
    return all;
  }
  // The same frames from the file: as the emulator was posed last, or before that.
  [[nodiscard]] std::vector<ReceivedPose> from_file(const std::vector<ReceivedPose>& walker) const {
    std::vector<ReceivedPose> same;
    for (const ReceivedPose& received : walker) {
      const auto at = [&](std::int64_t time_ns) {
        ReceivedPose pose = received;
        pose.frame = test::pose_at(clip_, time_ns);
        pose.frame.header = received.frame.header;
        pose.skeleton = clip_.skeleton;
        return pose;
      };
      const ReceivedPose last = at(received.posed_ns), before = at(received.posed_before_ns);
      const bool is_last =
          difference({received}, {last}).rms_rad() < difference({received}, {before}).rms_rad();
      same.push_back(is_last ? last : before);
    }
    return same;
  }
  [[nodiscard]] static Difference difference(const std::vector<ReceivedPose>& a,
                                             const std::vector<ReceivedPose>& b) {
    Difference all;
    for (std::size_t i = 0; i < a.size(); ++i) {
      all.add(Turns(*a[i].skeleton, a[i].frame), Turns(*b[i].skeleton, b[i].frame));
    }
    return all;
  }

 private:
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "walk.bvh"; }

  test::TempFolder folder_;
  clip::Clip clip_;
};

style::StyleModel humanoid_model() {
  const auto lesson = [](WalkerFamily family, std::uint32_t person, const std::string& group) {
    auto clip = motion::make_walker({.family = family, .person = person}).value();
    clip.path = "walker_" + std::to_string(person);
    const std::string subject = clip.path;
    return style::TrainingClip{std::move(clip), group, subject, "walk"};
  };
  style::TrainOptions options;
  options.target = "sway";
  options.dataset.space = motion::Space::kHumanoid;
  return style::train_style(
             {lesson(WalkerFamily::kMarch, 1, "march"), lesson(WalkerFamily::kMarch, 2, "march"),
              lesson(WalkerFamily::kSway, 3, "sway")},
             options)
      .value();
}

// As the live stage and `apply --cold` do it; empty if the skeleton lacks bones of the model.
std::vector<ReceivedPose> styled(const style::StyleModel& model, std::vector<ReceivedPose> walker) {
  struct Last final : StageOut {
    void frame(const StageFrame& styled) noexcept override { now = styled.frame; }
    Frame now;
  } last;
  const style::FilterOptions options;
  const auto bound = style::bind_model(model, *walker[0].skeleton, "sway");
  if (!bound) return {};
  style::StyleFilter filter(bound->get(), options);
  for (ReceivedPose& received : walker) {
    filter.process({.frame = received.frame}, last);
    received.frame = last.now;
  }
  return walker;
}

// What `convert` writes of a recording is read again as the same figure and the same poses.
void check_read_back(const std::vector<ReceivedPose>& walker) {
  const test::TempFolder folder;
  const auto path = folder.path() / "recorded.bvh";
  const Skeleton& sent = *walker[0].skeleton;
  clip::FramesClip frames(walker[0].skeleton);
  std::vector<double> time_s;
  for (const ReceivedPose& received : walker) {
    frames.add(received.frame);
    time_s.push_back(0.01 * static_cast<double>(time_s.size()));
  }
  auto recorded = frames.finish("recorded", 100.0, std::move(time_s));
  REQUIRE(recorded);
  clip::hold_missing(*recorded);
  REQUIRE(clip::write_bvh(*recorded, path));
  const auto read = clip::read_clip(path);
  REQUIRE(read);
  CHECK(read->warnings == std::vector<std::string>{});
  for (int b = 0; b < kBones; ++b) {
    const auto bone = static_cast<Bone>(b);
    const int from = sent.joint_of(bone), to = read->skeleton->joint_of(bone);
    INFO(bone_name(bone));
    CHECK((from < 0) == (to < 0));
    if (from < 0 || to < 0) continue;
    CHECK(read->skeleton->joints[to].name == sent.joints[from].name);
    CHECK((read->skeleton->joints[to].offset_m - sent.joints[from].offset_m).norm() < 1e-4);
    CHECK(angle_between_rad(read->skeleton->joints[to].T_world_joint,
                            sent.joints[from].T_world_joint) < kWithin_rad);
  }
  for (std::size_t i = 0; i < walker.size(); i += 10) {
    Difference off;
    off.add(Turns(sent, walker[i].frame), Turns(*read->skeleton, read->frame(static_cast<int>(i))));
    CHECK(off.most_rad < kWithin_rad);
  }
}

// Then nobody walks.
bool tracks_hands(const drivers::Driver& driver) {
  const auto emulator = driver.emulate({}).value();
  const Skeleton* const skeleton = emulator->skeleton(0);
  return skeleton != nullptr && hand_side(*skeleton).has_value();
}

void check(const Walk& walk) {
  const style::StyleModel model = humanoid_model();
  std::vector<std::string_view> without_style;
  std::vector<std::string_view> lacking;
  for (const drivers::Driver& driver : drivers::registry()) {
    if (driver.make_layout == nullptr || driver.emulate == nullptr || tracks_hands(driver))
      continue;
    INFO(driver.name);
    const auto walker = walk.through(driver);
    REQUIRE(walker.size() > 100);
    const auto file = walk.from_file(walker);
    CHECK(Walk::difference(walker, file).most_rad < kWithin_rad);
    check_read_back(walker);
    const auto styled_walker = styled(model, walker);
    if (styled_walker.empty()) {
      without_style.push_back(driver.name);
      continue;
    }
    CHECK(Walk::difference(styled_walker, walker).rms_rad() > 5 * kDegree);
    const Difference off = Walk::difference(styled_walker, styled(model, file));
    INFO(off.rms_rad() / kDegree << " deg rms, at most " << off.most_rad / kDegree);
    // Where the figure lacks bones of the model, it cannot know the pose quite as well.
    const bool whole =
        style::bind_model(model, *walker[0].skeleton, "sway").value()->remark.empty();
    CHECK(off.rms_rad() < (whole ? kWithin_rad : kLacking_rad));
    if (!whole) lacking.push_back(driver.name);
  }
  // One figure has no legs, others no toes, or neither feet, hands nor shoulders.
  CHECK(without_style == std::vector<std::string_view>{"posed"});
  CHECK(lacking == std::vector<std::string_view>{"axis", "template_mocap"});
}

}  // namespace

TEST_CASE("a walk passes through every mocap system as it was, and takes the same style") {
  check(Walk(motion::make_walker({.seconds = 3.0, .rate_hz = 120.0, .noise_deg = 0.0}).value()));
}

TEST_CASE("a recorded walk passes through every mocap system as it was, and takes the same style") {
  const auto recording = test::shared("data/cmu/07_01.amc");
  if (!recording) SKIP_WITHOUT_SHARED();
  check(Walk(clip::read_clip(*recording).value()));
}

TEST_CASE("each person of a device performs a clip of its own") {
  const test::TempFolder folder;
  const auto one = folder.path() / "one.bvh", two = folder.path() / "two.bvh";
  REQUIRE(clip::write_bvh(motion::make_walker({.seconds = 3.0}).value(), one));
  REQUIRE(clip::write_bvh(
      motion::make_walker({.family = WalkerFamily::kSway, .seconds = 3.0}).value(), two));
  // The first has two people, the second gets one more; its others are a person and a prop.
  for (const char* name : {"mvn", "natnet"}) {
    INFO(name);
    const drivers::Driver& driver = *drivers::find_driver(name);
    const auto last_of = [&](const std::vector<std::filesystem::path>& clips) {
      const auto all = test::receive_walk(driver, clips, kNanosPerSecond);
      std::map<std::string, Frame> last;
      for (const ReceivedPose& received : all) {
        if (received.skeleton->joints.size() > 1) last[received.body] = received.frame;
      }
      return last;
    };
    const auto mixed = last_of({one, two}), same = last_of({two, two});
    REQUIRE(mixed.size() == 2);
    REQUIRE(same.size() == 2);
    int equal = 0;
    for (const auto& [body, frame] : mixed) {
      equal += frame.rotation_xyzw == same.at(body).rotation_xyzw ? 1 : 0;
    }
    CHECK(equal == 1);  // the one who performs the second clip in both
  }
  const auto phone = drivers::find_driver("mocopi")->emulate({}).value();
  const auto crowd = clip_motion({one, two}, *phone);
  REQUIRE_FALSE(crowd);
  CHECK(crowd.error().message == "the device has fewer people than there are clips: name 1 clip");
}

}  // namespace posed::emulate
