#include "daemon/output/inbox.hpp"

#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/output/fit.hpp"
#include "daemon/output/output.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"

namespace posed::output {
namespace {

Frame numbered(std::uint32_t stream, std::uint64_t sequence) {
  Frame frame;
  frame.header.stream = stream;
  frame.header.sequence = sequence;
  return frame;
}

struct InboxRig {
  std::unique_ptr<system::EventFd> wake = system::EventFd::open().value();
  Inbox inbox{{"ann", "", "glove"}, *wake};
  Delivery delivery{3};

  // "B1 B2 R7": places and sequences.
  std::string taken() {
    inbox.drain(delivery);
    std::string text;
    delivery.for_each([&](std::size_t place, const Frame& frame) {
      text += "BLR"[place] + std::to_string(frame.header.sequence) + " ";
    });
    return text;
  }
};

// Skeletons that, when they are freed, let another thread use the inbox.
class FreedSkeletons {
 public:
  explicit FreedSkeletons(Inbox& inbox) : inbox_(inbox) {}

  [[nodiscard]] std::shared_ptr<const Skeleton> make() {
    return {new Skeleton, [this](const Skeleton* skeleton) {
              delete skeleton;
              note();
            }};
  }
  int freed = 0, under_the_lock = 0;

 private:
  void note() {
    ++freed;
    const auto done = std::make_shared<std::atomic<bool>>(false);
    others_.emplace_back([this, done] {
      inbox_.sample({});
      *done = true;
    });
    for (int i = 0; i < 500 && !*done; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!*done) ++under_the_lock;
  }

  Inbox& inbox_;
  std::vector<std::jthread> others_;
};

TEST_CASE("no two persons of an output have one name") {
  std::vector<std::string> names(3);
  CHECK(distinct_name("s2", "s1", 0, names) == "s2");
  CHECK(distinct_name("s2", "s2", 1, names) == "s2-2");
  CHECK(distinct_name("s2", "ann", 2, names) == "ann");
  CHECK(distinct_name("s2", "s2", 1, names) == "s2-2");
}

}  // namespace

TEST_CASE("an inbox takes the frames of the streams that its output names, in their order") {
  InboxRig rig;
  CHECK(rig.inbox.wants("ann"));
  CHECK(rig.inbox.wants("glove"));
  CHECK_FALSE(rig.inbox.wants("bob"));
  CHECK_FALSE(rig.inbox.wants(""));
  rig.inbox.frame(numbered(3, 1));  // nobody of this id has come
  rig.inbox.stream_comes(info_of(3, "ann", nullptr));
  rig.inbox.stream_comes(info_of(4, "glove", nullptr));
  rig.inbox.frame(numbered(3, 2));
  rig.inbox.frame(numbered(4, 7));
  rig.inbox.frame(numbered(3, 3));
  CHECK(rig.taken() == "B2 R7 B3 ");
  REQUIRE(rig.delivery.streams[0] != nullptr);
  CHECK(rig.delivery.streams[0]->name == "ann");
  CHECK(rig.delivery.streams[1] == nullptr);
  CHECK(rig.taken().empty());
  CHECK(rig.inbox.frames() == 3);
  CHECK(rig.inbox.dropped() == 0);
}

TEST_CASE("a full inbox keeps the newest frames and counts the others") {
  InboxRig rig;
  rig.inbox.stream_comes(info_of(3, "ann", nullptr));
  for (int round = 0; round < 3; ++round) {  // the ring begins at another place each time
    for (std::uint64_t i = 1; i <= Delivery::kDepth + 5; ++i) rig.inbox.frame(numbered(3, i));
    std::string expected;
    for (std::uint64_t i = 6; i <= Delivery::kDepth + 5; ++i) {
      expected += "B" + std::to_string(i) + " ";
    }
    CHECK(rig.taken() == expected);
  }
  CHECK(rig.inbox.dropped() == 15);
  rig.inbox.stream_comes(info_of(4, "glove", nullptr));
  rig.inbox.frame(numbered(4, 1));
  for (std::uint64_t i = 1; i <= 3 * Delivery::kDepth; ++i) rig.inbox.frame(numbered(3, i));
  CHECK(rig.taken().find("R1 B33 ") == 0);  // another stream's frames stay
}

TEST_CASE("an inbox bridges a wait for each of many people as for one") {
  constexpr std::uint32_t kPeople = 16;
  const auto wake = system::EventFd::open().value();
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < kPeople; ++i) names.push_back("ann-" + std::to_string(i));
  Inbox inbox(names, *wake);
  for (std::uint32_t i = 0; i < kPeople; ++i) inbox.stream_comes(info_of(i, names[i], nullptr));
  for (std::uint64_t step = 0; step < Delivery::kDepth; ++step) {
    for (std::uint32_t i = 0; i < kPeople; ++i) inbox.frame(numbered(i, step));
  }
  CHECK(inbox.dropped() == 0);
  Delivery delivery(kPeople);
  inbox.drain(delivery);
  std::uint64_t taken = 0;
  delivery.for_each([&](std::size_t place, const Frame& frame) {
    CHECK(place == taken % kPeople);
    CHECK(frame.header.sequence == taken / kPeople);
    ++taken;
  });
  CHECK(taken == kPeople * Delivery::kDepth);
}

TEST_CASE("the frames of a stream that leaves or returns otherwise are not sent any more") {
  InboxRig rig;
  rig.inbox.stream_comes(info_of(3, "ann", nullptr));
  rig.inbox.stream_comes(info_of(4, "glove", nullptr));
  rig.inbox.frame(numbered(3, 1));
  rig.inbox.frame(numbered(4, 1));
  rig.inbox.stream_comes(info_of(0x10003, "ann", nullptr));  // its next generation
  rig.inbox.frame(numbered(3, 2));
  rig.inbox.frame(numbered(0x10003, 3));
  rig.inbox.stream_leaves(3);  // too late to matter
  CHECK(rig.taken() == "R1 B3 ");
  CHECK(rig.inbox.dropped() == 1);
  rig.inbox.frame(numbered(4, 2));
  rig.inbox.stream_leaves(4);
  CHECK(rig.taken().empty());
  CHECK(rig.delivery.streams[2] == nullptr);
  CHECK(rig.inbox.dropped() == 2);
}

TEST_CASE("an inbox frees nothing while it is locked") {
  InboxRig rig;
  FreedSkeletons skeletons(rig.inbox);
  rig.inbox.stream_comes(info_of(3, "ann", skeletons.make()));
  rig.inbox.stream_leaves(3);
  CHECK(skeletons.freed == 1);
  rig.inbox.stream_comes(info_of(4, "ann", skeletons.make()));
  rig.inbox.stream_comes(info_of(5, "ann", skeletons.make()));
  CHECK(skeletons.freed == 2);
  rig.inbox.drain(rig.delivery);
  rig.inbox.stream_leaves(5);
  CHECK(skeletons.freed == 2);  // the delivery still has it
  rig.inbox.drain(rig.delivery);
  CHECK(skeletons.freed == 3);
  CHECK(skeletons.under_the_lock == 0);
}

TEST_CASE("only the newest sample of each stream waits") {
  InboxRig rig;
  rig.inbox.stream_comes(info_of(3, "ann", nullptr));
  rig.inbox.stream_comes(info_of(4, "glove", nullptr));
  Sample sample;
  sample.header.stream = 3;
  sample.value[0] = 1.0F;
  rig.inbox.sample(sample);
  sample.value[0] = 2.0F;
  rig.inbox.sample(sample);
  sample.header.stream = 4;
  sample.value[0] = 3.0F;
  rig.inbox.sample(sample);
  rig.inbox.drain(rig.delivery);
  REQUIRE(rig.delivery.samples[0]);
  CHECK(rig.delivery.samples[0]->value[0] == 2.0F);
  rig.inbox.drain(rig.delivery);
  CHECK_FALSE(rig.delivery.samples[0]);
}

TEST_CASE("a rate limit thins a faster stream evenly and leaves a slower one alone") {
  const auto admitted = [](double limit_hz, double rate_hz, double jitter_s) {
    RateLimit limit(limit_hz);
    int count = 0;
    for (int i = 0; i < 1000; ++i) {
      const double time_s = i / rate_hz + (i % 2 == 0 ? jitter_s : -jitter_s);
      if (limit.admit(nanoseconds(1.0 + time_s))) ++count;
    }
    return count;
  };
  CHECK(admitted(60.0, 120.0, 0.0) == 500);
  CHECK(admitted(60.0, 240.0, 0.0) == 250);
  CHECK(admitted(60.0, 60.0, 0.0015) == 1000);  // jitter costs nothing
  CHECK(admitted(60.0, 30.0, 0.005) == 1000);
  CHECK(admitted(60.0, 100.0, 0.0) == Approx(600).margin(2));
  CHECK(admitted(0.0, 1000.0, 0.0) == 1000);
  RateLimit limit(10.0);  // a pause is not made up for
  CHECK(limit.admit(0));
  CHECK(limit.admit(5 * kNanosPerSecond));
  CHECK_FALSE(limit.admit(5 * kNanosPerSecond + kNanosPerSecond / 20));
}

}  // namespace posed::output
