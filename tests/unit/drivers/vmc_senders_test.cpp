// Which datagrams make a frame: VMC senders as they are found, each with its own order and packing.
#include <catch2/catch.hpp>

#include <functional>
#include <random>

#include "drivers/vmc/decoder.hpp"
#include "tests/unit/drivers/vmc_rig.hpp"

namespace posed::drivers {
namespace {

using test::bundle_of;
using test::Bytes;
using test::vmc_message;
using test::VmcSession;

using Burst = std::vector<Bytes>;

constexpr int kSenderFrames = 200;
constexpr int kLearning = 12;  // frames at the start that need not arrive at once
constexpr std::int64_t kSenderPeriod_ns = 16'666'667;

float place_m(int frame) { return 0.001F * static_cast<float>(frame); }

Bytes bone_message(std::size_t bone, int frame) {
  const Vec3f at_m = bone == vmc::kHips ? Vec3f{place_m(frame), 1, 0} : Vec3f{0, 0.1F, 0};
  return vmc_message([&](auto& w) { w.bone(bone, at_m, kIdentity); });
}
Bytes time_message(double time_s) {
  return vmc_message([&](auto& w) { w.time(static_cast<float>(time_s)); });
}
Bytes time_of(int frame) { return time_message(frame / 60.0); }
const Bytes& ok_message() {
  static const Bytes message = vmc_message([](auto& w) { w.loaded(); });
  return message;
}
const Bytes& root_message() {
  static const Bytes message = vmc_message([](auto& w) { w.root({}, kIdentity); });
  return message;
}
const Bytes& blend_bundle() {
  static const Bytes bundle = bundle_of({vmc_message([](auto& w) { w.blend("Joy", 0.5F); }),
                                         vmc_message([](auto& w) { w.apply(); })});
  return bundle;
}
std::vector<Bytes> bone_messages(int frame) {
  std::vector<Bytes> messages;
  for (std::size_t bone = 0; bone < vmc::kBoneCount; ++bone) {
    messages.push_back(bone_message(bone, frame));
  }
  return messages;
}
// Bundles of 16 messages.
std::vector<Bytes> in_bundles(const std::vector<Bytes>& messages, std::size_t most = 16) {
  std::vector<Bytes> bundles;
  for (std::size_t i = 0; i < messages.size(); i += most) {
    const auto first = messages.begin() + static_cast<std::ptrdiff_t>(i);
    const auto count = std::min(most, messages.size() - i);
    bundles.push_back(bundle_of({first, first + static_cast<std::ptrdiff_t>(count)}));
  }
  return bundles;
}
std::vector<Bytes> operator+(std::vector<Bytes> a, const std::vector<Bytes>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

using Sender = std::function<Burst(int frame)>;

// Virtual Motion Capture: bundles of 13 bones, one of blend shapes, and last the root, the other
// bones in a bundle of their own, status and time.
std::vector<Bytes> original_sender(int frame) {
  const auto bones = bone_messages(frame);
  auto bundles = in_bundles({bones.begin(), bones.begin() + 52}, 13);
  bundles.push_back(blend_bundle());
  const Bytes rest = bundle_of({bones.begin() + 52, bones.end()});
  bundles.push_back(bundle_of({root_message(), rest, ok_message(), time_of(frame)}));
  return bundles;
}

// Feeds a sender's frames; each must be out when its last datagram is in, and none may be partial.
void check_sender(const Sender& sender, bool with_time = true) {
  VmcSession session;
  int at_once = 0;
  for (int i = 0; i < kSenderFrames; ++i) {
    const std::size_t before = session.sink.frames.size();
    session.feed(sender(i), i * kSenderPeriod_ns);
    if (i < kLearning) continue;
    REQUIRE(session.sink.frames.size() == before + 1);
    const Frame& frame = session.sink.frames.back();
    CHECK(frame.joint_count == vmc::kBoneCount);
    CHECK(frame.valid.count() == vmc::kBoneCount);
    if (frame.root_position_m[0] == place_m(i)) ++at_once;
    if (!with_time) continue;
    const Frame& earlier = session.sink.frames[before - 1];
    CHECK(seconds(frame.header.device_ns - earlier.header.device_ns) ==
          Approx(1.0 / 60.0).margin(1e-6));
  }
  CHECK(at_once == kSenderFrames - kLearning);
  CHECK(session.layouts.size() == 1);
}

}  // namespace

TEST_CASE("frames of VMC senders arrive whole and at once, whatever their order and packing") {
  SECTION("Virtual Motion Capture") { check_sender(original_sender); }
  SECTION("one bundle, status and time first") {
    check_sender(
        [](int i) { return Burst{bundle_of(Burst{ok_message(), time_of(i)} + bone_messages(i))}; });
  }
  SECTION("root, bones, blend shapes, status and time in datagrams of their own") {
    check_sender([](int i) {
      return Burst{root_message()} + in_bundles(bone_messages(i)) +
             Burst{blend_bundle(), ok_message(), time_of(i)};
    });
  }
  SECTION("single messages, time first") {
    check_sender([](int i) { return Burst{time_of(i), root_message()} + bone_messages(i); });
  }
  SECTION("single messages, time first and coarse") {
    check_sender([](int i) { return Burst{time_message(1.7e12)} + bone_messages(i); }, false);
  }
  SECTION("a head bundle with status, time and root; bundles; a last one with Apply") {
    check_sender([](int i) {
      return Burst{bundle_of({ok_message(), time_of(i), root_message()})} +
             in_bundles(bone_messages(i)) + Burst{blend_bundle()};
    });
  }
  SECTION("bones only, in bundles") {
    check_sender([](int i) { return in_bundles(bone_messages(i)); }, false);
  }
  SECTION("bones only, as single messages") {
    check_sender([](int i) { return bone_messages(i); }, false);
  }
  SECTION("status and time with every second frame") {
    check_sender(
        [](int i) {
          const auto bones = in_bundles(bone_messages(i));
          return i % 2 == 0 ? bones + Burst{ok_message(), time_of(i)} : bones;
        },
        false);
  }
  SECTION("status and time a few times a second") {
    check_sender(
        [](int i) {
          const auto bones = in_bundles(bone_messages(i));
          return i % 15 == 0 ? Burst{ok_message(), time_of(i)} + bones : bones;
        },
        false);
  }
}

TEST_CASE("a VMC sender that changes its order is learnt again") {
  VmcSession session;
  for (int i = 0; i < 100; ++i) {
    auto bones = bone_messages(i);
    if (i >= 50) std::ranges::reverse(bones);
    session.feed(bones, i * kSenderPeriod_ns);
  }
  for (int i = 70; i < 100; ++i) {
    const Frame& frame =
        session.sink.frames[session.sink.frames.size() - 100 + static_cast<std::size_t>(i)];
    CHECK(frame.root_position_m[0] == place_m(i));
    CHECK(frame.valid.count() == vmc::kBoneCount);
  }
}

TEST_CASE("lost VMC datagrams cost the frames that they belong to, and no others") {
  std::mt19937 random(11);
  VmcSession session;
  std::size_t lost = 0;
  std::size_t whole = 0;
  for (int i = 0; i < 2000; ++i) {
    auto datagrams =
        Burst{root_message()} + in_bundles(bone_messages(i)) + Burst{ok_message(), time_of(i)};
    if (i > 20 && random() % 20 == 0) {
      datagrams.erase(datagrams.begin() + static_cast<std::ptrdiff_t>(random() % datagrams.size()));
      ++lost;
    }
    session.feed(datagrams, i * kSenderPeriod_ns);
  }
  for (const Frame& frame : session.sink.frames) {
    if (frame.valid.count() == vmc::kBoneCount) ++whole;
  }
  CHECK(lost > 50);
  CHECK(session.sink.frames.size() > 1980);
  CHECK(whole + lost > 1980);
  CHECK(session.layouts.size() == 1);
}

TEST_CASE("the same VMC datagrams at the same times give the same frames") {
  std::mt19937 random(13);
  std::vector<std::pair<std::int64_t, Bytes>> datagrams;
  for (int i = 0; i < 300; ++i) {
    std::int64_t now_ns = i * kSenderPeriod_ns;
    for (Bytes& datagram : original_sender(i)) {
      if (random() % 30 != 0) datagrams.emplace_back(now_ns, std::move(datagram));
      now_ns += static_cast<std::int64_t>(random() % 2'000'000);
    }
  }
  std::array<VmcSession, 2> sessions;
  for (VmcSession& session : sessions) {
    for (const auto& [now_ns, datagram] : datagrams) session.feed(datagram, now_ns);
  }
  REQUIRE(sessions[0].sink.frames.size() == sessions[1].sink.frames.size());
  CHECK(sessions[0].sink.frames.size() > 250);
  for (std::size_t i = 0; i < sessions[0].sink.frames.size(); ++i) {
    CHECK(test::same_pose(sessions[0].sink.frames[i], sessions[1].sink.frames[i]));
  }
}

TEST_CASE("VMC times order the datagrams and are the device time while they are fine enough") {
  vmc::SenderClock clock;
  CHECK(clock.device_ns() == kNoTime_ns);
  CHECK(clock.accept(10.0F) == Outcome::kOk);
  CHECK(clock.accept(10.5F) == Outcome::kOk);
  CHECK(clock.device_ns() == 500'000'000);
  CHECK(clock.accept(10.5F) == Outcome::kOk);
  CHECK(clock.accept(10.45F) == Outcome::kLate);
  CHECK(clock.accept(-1.0F) == Outcome::kOutOfRange);
  CHECK(clock.accept(std::nanf("")) == Outcome::kOutOfRange);
  CHECK(clock.device_ns() == 500'000'000);
  CHECK(clock.accept(0.0F) == Outcome::kOk);  // started again
  CHECK(clock.accept(1.0F) == Outcome::kOk);
  CHECK(clock.device_ns() == 1'500'000'000);
  int late = 0;
  while (clock.accept(0.95F) == Outcome::kLate) ++late;  // gone back for good
  CHECK(late == 7);
  CHECK(clock.accept(1.7e9F) == Outcome::kOk);  // one damaged value
  CHECK(clock.device_ns() == 1'500'000'000);
  for (int i = 0; i < 8; ++i) CHECK(clock.accept(1.7e9F) == Outcome::kOk);
  CHECK(clock.device_ns() == kNoTime_ns);
  CHECK(clock.accept(3.0F) == Outcome::kOk);
  CHECK(clock.device_ns() == 1'500'000'000);
}

}  // namespace posed::drivers
