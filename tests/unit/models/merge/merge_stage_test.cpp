// The merge stage in time: alignment, waiting, lost gloves. Times in the tests count from zero.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/allocations.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/merge_rig.hpp"
#include "tests/support/seeds.hpp"

namespace posed::merge {
namespace {

using test::kMs;

constexpr int kBentJoint = 4;  // of the index finger

struct OneHand {
  explicit OneHand(Parameters changed = {})
      : glove(test::glove_skeleton(Side::kLeft)),
        body(test::walker_skeleton()),
        rig(test::merge_context(body, glove, nullptr, std::move(changed))) {}

  // A hand that bends by 1 rad/s.
  void send_glove(std::int64_t at_ns, double rad = -1.0) {
    rig.glove(0, test::glove_frame(*glove, rad < 0.0 ? seconds(at_ns) : rad, at_ns));
  }
  void send_body(std::int64_t at_ns) { rig.body(test::body_frame(*body, ++sequence, at_ns)); }
  [[nodiscard]] double bent_rad(const Frame& frame) const {
    return test::bent_rad(*rig.skeleton, Side::kLeft, kBentJoint, frame);
  }
  [[nodiscard]] bool valid(const Frame& frame) const {
    return frame.valid[static_cast<std::size_t>(
        rig.skeleton->joint_of(hand_bone(Side::kLeft, kBentJoint)))];
  }

  std::shared_ptr<const Skeleton> glove, body;
  test::MergeRig rig;
  std::uint64_t sequence = 0;
};

}  // namespace

TEST_CASE("a frame waits for the glove's next one, and gets the hand of its own time") {
  OneHand hand;
  hand.send_glove(0);
  hand.send_body(3 * kMs);
  CHECK(hand.rig.out.empty());
  hand.send_glove(10 * kMs);
  REQUIRE(hand.rig.out.size() == 1);
  CHECK(hand.bent_rad(hand.rig.out[0].frame) == Approx(0.003).margin(1e-6));
  CHECK(hand.rig.out[0].frame.lag_ms == Approx(7.0F));
  CHECK(hand.rig.out[0].frame.quality == Quality::kMeasured);
  // One that is older than what the glove has measured goes out at once.
  hand.send_body(10 * kMs);
  REQUIRE(hand.rig.out.size() == 2);
  CHECK(hand.rig.out[1].frame.lag_ms == 0.0F);
}

TEST_CASE("a frame waits no longer than it may, and then takes the newest pose") {
  OneHand hand({{"wait_s", 0.005}});
  hand.send_glove(0, 0.2);
  hand.send_body(3 * kMs);
  hand.rig.until(100 * kMs);
  REQUIRE(hand.rig.out.size() == 1);
  CHECK(hand.rig.out[0].at_ns == 8 * kMs);
  CHECK(hand.rig.out[0].frame.lag_ms == Approx(5.0F));
  CHECK(hand.bent_rad(hand.rig.out[0].frame) == Approx(0.2).margin(1e-6));
  CHECK(hand.rig.out[0].frame.quality == Quality::kMeasured);
}

TEST_CASE("the same pose twice is marked as held") {
  OneHand hand({{"wait_s", 0.0}});
  hand.send_glove(0, 0.2);
  hand.send_body(3 * kMs);
  hand.send_body(11 * kMs);
  REQUIRE(hand.rig.out.size() == 2);
  CHECK(hand.rig.out[0].frame.quality == Quality::kMeasured);
  CHECK(hand.rig.out[1].frame.quality == Quality::kHeld);
  CHECK(hand.valid(hand.rig.out[1].frame));
}

TEST_CASE("when too many frames wait, the oldest goes out at once") {
  OneHand hand({{"wait_s", 0.1}});
  hand.send_glove(0, 0.2);
  constexpr auto kMaxFrames = static_cast<int>(kMaxWaiting);
  for (int i = 1; i <= kMaxFrames; ++i) hand.send_body(i * kMs);
  CHECK(hand.rig.out.empty());
  hand.send_body((kMaxFrames + 1) * kMs);
  REQUIRE(hand.rig.out.size() == 1);
  CHECK(hand.rig.out[0].frame.header.sequence == 1);
  CHECK(hand.rig.out[0].frame.lag_frames == kMaxFrames - 1);
  hand.rig.flush();
  CHECK(hand.rig.out.size() == kMaxWaiting + 1);
}

TEST_CASE("a lost glove costs no wait: its hand is held, relaxes, and comes back without a jump") {
  OneHand hand;
  std::vector<std::pair<double, double>> bent;  // time [s], rad
  std::vector<std::pair<double, Quality>> quality;
  const auto at_s = [](const Frame& frame) { return seconds(frame.header.arrival_ns); };
  std::set<std::uint64_t> waited_while_lost;
  hand.rig.each = [&](const test::MergeRig::Out& out) {
    bent.emplace_back(at_s(out.frame), hand.bent_rad(out.frame));
    quality.emplace_back(at_s(out.frame), out.frame.quality);
    CHECK(hand.valid(out.frame));
    const bool lost = at_s(out.frame) > 1.05 && at_s(out.frame) < 3.99;
    if (lost && out.frame.lag_ms > 0.0F) waited_while_lost.insert(out.frame.header.sequence);
  };
  hand.send_glove(0, 1.2);
  for (int ms = 1; ms < 5000; ++ms) {
    const bool away = ms > 1000 && ms < 4000;
    if (ms % 10 == 0 && !away) hand.send_glove(ms * kMs, ms < 2000 ? 1.2 : 0.9);
    if (ms % 8 == 0) hand.send_body(ms * kMs);
  }
  CHECK(waited_while_lost.empty());
  double fastest = 0.0;
  for (std::size_t i = 1; i < bent.size(); ++i) {
    fastest = std::max(fastest, std::abs(bent[i].second - bent[i - 1].second) / 0.008);
  }
  CHECK(fastest < 10.0);  // rad/s; a jump between two frames would be 40 and more
  const auto value = [&](const auto& row, double s) {
    return std::ranges::lower_bound(row, s, {}, [](const auto& one) { return one.first; })->second;
  };
  CHECK(value(bent, 0.9) == Approx(1.2).margin(1e-6));
  CHECK(value(bent, 1.9) == Approx(1.2).margin(1e-6));
  CHECK(value(bent, 2.7) == Approx(30.0 * 3.14159265 / 180.0).margin(1e-4));
  CHECK(value(bent, 4.2) == Approx(0.9).margin(1e-6));
  CHECK(value(quality, 0.9) == Quality::kMeasured);
  CHECK(value(quality, 1.5) == Quality::kHeld);
  CHECK(value(quality, 3.0) == Quality::kPredicted);
  CHECK(value(quality, 4.2) == Quality::kMeasured);
}

TEST_CASE("a glove that never came leaves the hand unknown, and soon costs no wait") {
  OneHand hand;
  for (int ms = 0; ms < 500; ms += 10) hand.send_body(ms * kMs);
  hand.rig.until(1000 * kMs);
  REQUIRE(hand.rig.out.size() == 50);
  for (const auto& out : hand.rig.out) {
    CHECK_FALSE(hand.valid(out.frame));
    CHECK(out.frame.quality == Quality::kMeasured);
    if (out.frame.header.arrival_ns > 50 * kMs) CHECK(out.frame.lag_ms == 0.0F);
  }
}

TEST_CASE("a joint that the glove does not measure stays the body's") {
  OneHand hand;
  for (int ms = 0; ms <= 20; ms += 10) {
    Frame frame = test::glove_frame(*hand.glove, 0.3, ms * kMs);
    frame.valid[static_cast<std::size_t>(hand_joint(1, 1))] = false;
    frame.rotation_xyzw[static_cast<std::size_t>(hand_joint(4, 2))] = {};  // no rotation at all
    hand.rig.glove(0, frame);
  }
  hand.send_body(15 * kMs);
  REQUIRE(hand.rig.out.size() == 1);
  const Frame& frame = hand.rig.out[0].frame;
  CHECK_FALSE(hand.valid(frame));
  CHECK(frame.valid[static_cast<std::size_t>(
      hand.rig.skeleton->joint_of(hand_bone(Side::kLeft, kBentJoint + 1)))]);
  CHECK_FALSE(
      frame.valid[static_cast<std::size_t>(hand.rig.skeleton->joint_of(Bone::kLeftLittleDistal))]);
}

TEST_CASE("a glove whose clock starts again goes on at once") {
  OneHand hand({{"wait_s", 0.0}});
  const auto send = [&](std::int64_t device_ns, std::int64_t offset_ns, double rad) {
    Frame frame = test::glove_frame(*hand.glove, rad, device_ns + offset_ns);
    frame.header.device_ns = device_ns;
    frame.header.clock = {.offset_ns = offset_ns, .valid = true};
    hand.rig.glove(0, frame);
  };
  for (int ms = 5000; ms < 6000; ms += 10) send(ms * kMs, 0, 0.2);
  hand.send_body(6000 * kMs);
  // For a while nobody knows the new offset: times are far in the past.
  Frame early = test::glove_frame(*hand.glove, 0.4, 6010 * kMs);
  early.header.device_ns = 0;
  early.header.clock = {.offset_ns = 0, .valid = true};
  hand.rig.glove(0, early);
  for (int ms = 10; ms < 1000; ms += 10) send(ms * kMs, 6010 * kMs, 0.4);
  hand.send_body(7000 * kMs);
  REQUIRE(hand.rig.out.size() == 2);
  CHECK(hand.bent_rad(hand.rig.out[1].frame) == Approx(0.4).margin(1e-6));
}

TEST_CASE("a stale or foreign frame of a partner changes nothing") {
  OneHand hand({{"wait_s", 0.0}});
  hand.send_glove(0, 0.2);
  Frame stale = test::glove_frame(*hand.glove, 0.9, 10 * kMs);
  stale.quality = Quality::kStale;
  hand.rig.glove(0, stale);
  Frame foreign = test::glove_frame(*test::glove_skeleton(Side::kRight), 0.9, 11 * kMs);
  hand.rig.glove(0, foreign);
  hand.rig.glove(1, foreign);
  hand.rig.glove(7, foreign);
  hand.send_body(12 * kMs);
  REQUIRE(hand.rig.out.size() == 1);
  CHECK(hand.bent_rad(hand.rig.out[0].frame) == Approx(0.2).margin(1e-6));
}

TEST_CASE("merging allocates nothing") {
  OneHand hand;
  const Frame body = test::body_frame(*hand.body, 1, 0);
  const Frame glove = test::glove_frame(*hand.glove, 0.5, 0);
  int count = 0;
  hand.rig.each = [&count](const test::MergeRig::Out&) { ++count; };
  Frame sent_body = body, sent_glove = glove;
  const std::uint64_t before = test::allocations();
  for (int ms = 0; ms < 1000; ++ms) {
    sent_body.header.arrival_ns = sent_glove.header.arrival_ns = ms * kMs;
    if (ms % 8 == 0) hand.rig.body(sent_body);
    if (ms % 10 == 0) hand.rig.glove(0, sent_glove);
  }
  CHECK(test::allocations() == before);
  CHECK(count > 100);
}

// Whatever comes when: each frame of the body leaves once, in order, and not later than it may.
TEST_CASE("frames leave in order, each once and in time, in whatever order they come",
          "[property]") {
  const auto [first, last] = test::seeds(1);
  std::size_t frames = 0, waited = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    test::Dice dice(seed);
    const double wait_s = dice.chance(0.1) ? 0.0 : dice.within(0.0, 0.1);
    const std::int64_t wait_ns = nanoseconds(wait_s);
    OneHand hand({{"wait_s", wait_s}, {"hold_s", dice.within(0.0, 0.3)}});
    std::uint64_t next = 1;
    hand.rig.each = [&](const test::MergeRig::Out& out) {
      CHECK(out.frame.header.sequence == next++);
      CHECK(out.at_ns <= out.frame.header.arrival_ns + wait_ns);
      CHECK(static_cast<double>(out.frame.lag_ms) <= wait_s * 1e3 + 1e-3);
      waited += out.frame.lag_ms > 0.0F ? 1 : 0;
      for (std::size_t j = 0; j < out.frame.joint_count; ++j) {
        const auto& q = out.frame.rotation_xyzw[j];
        const float length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
        CHECK(length == Approx(1.0F).margin(1e-4));
      }
    };
    std::int64_t now_ns = 0, silent_until_ns = 0;
    const double body_share = dice.within(0.1, 0.9);
    for (int i = 0; i < 300; ++i) {
      now_ns += dice.chance(0.1) ? 0 : nanoseconds(dice.within(0.0, 0.01));
      if (dice.chance(0.01)) silent_until_ns = now_ns + nanoseconds(dice.within(0.0, 1.0));
      if (dice.chance(0.01)) now_ns += nanoseconds(dice.within(0.0, 1.0));
      const bool body = dice.chance(body_share);
      Frame frame = body ? test::body_frame(*hand.body, ++hand.sequence, now_ns)
                         : test::glove_frame(*hand.glove, dice.within(0.0, 1.5), now_ns);
      if (dice.chance(0.8)) {  // the times of a device, with any error
        frame.header.device_ns =
            now_ns - nanoseconds(dice.within(0.0, dice.chance(0.1) ? 5.0 : 0.01));
        frame.header.clock.valid = true;
      }
      if (body) {
        ++frames;
        hand.rig.body(frame);
      } else if (now_ns >= silent_until_ns) {
        hand.rig.glove(0, frame);
      }
    }
    hand.rig.flush();
    CHECK(next == hand.sequence + 1);
  }
  WARN(last - first + 1 << " runs, " << frames << " frames, " << waited << " of them waited");
  if (!test::few_seeds()) CHECK(waited > frames / 20);
}

}  // namespace posed::merge
