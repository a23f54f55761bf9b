// The engine with a generate stage: which frames its lag holds back, when silence and the end
// release them, and what a play command does.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "daemon/pipeline/stream_engine.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/ms.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::pipeline {
namespace {

using test::kMs;
constexpr std::int64_t kPeriod_ns = 20 * kMs;

class CollectedFrames final : public EngineOut {
 public:
  void item(const Item& item) noexcept override {
    if (item.kind == Item::Kind::kFrame) frames.push_back(item.frame);
    if (item.kind == Item::Kind::kEvent) events.push_back(item.stream_event.kind);
  }
  void decision(const Decision& decision) noexcept override { decisions.push_back(decision); }

  std::vector<Frame> frames;
  std::vector<int> events;
  std::vector<Decision> decisions;
};

// A hand stream of 50 Hz with a lag of two frames, and a model for it.
class Hand {
 public:
  Hand() {
    EngineOptions options;
    options.stream = 1;
    options.stale_after_ns = 500 * kMs;
    options.stages.push_back(
        {&generate::generate_type(),
         std::make_unique<generate::GenerateStage>(
             skeleton_, smooth::LiveOptions{.lag = {.frames = 2}}, 50.0, model.get())});
    engine.emplace(std::move(options));
  }

  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      Frame frame;
      frame.header.sequence = ++sequence;
      frame.header.arrival_ns = now_ns += kPeriod_ns;
      HandAngles angles{};
      for (std::size_t c = 0; c < angles.size(); c += 3) {
        angles[c] = 0.5 + 0.3 * std::sin(0.05 * double(sequence) + 0.1 * double(c));
      }
      set_hand_angles(*skeleton_, angles, frame);
      engine->on_frame(frame, out);
    }
  }

  Ack play(const std::string& labels, double tempo = 1.0) {
    const auto order =
        gesture::make_play_order(model->gesture(), gesture::split_labels(labels), tempo, false)
            .value();
    return engine->apply(test::play_command(1, order, 7), out);
  }

  // Calls the ticks that are due during this time, as the worker does.
  void silence(std::int64_t duration_ns) {
    const std::int64_t end_ns = now_ns + duration_ns;
    for (; now_ns < end_ns; now_ns += kMs) static_cast<void>(engine->tick(now_ns, out));
  }

  std::shared_ptr<const Skeleton> skeleton_ =
      std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  std::unique_ptr<const generate::BoundModel> model =
      generate::bind_model(test::toy_gesture_model(), *skeleton_, 50.0, "toy").value();
  std::optional<StreamEngine> engine;
  CollectedFrames out;
  std::uint64_t sequence = 0;
  std::int64_t now_ns = 0;
};

}  // namespace

TEST_CASE("frames leave after the lag, with their own sequence and times") {
  Hand hand;
  hand.frames(20);
  const Frame& last = hand.out.frames.back();
  CHECK(last.header.sequence == 18);
  CHECK(last.header.arrival_ns == 18 * kPeriod_ns);
  CHECK(last.lag_frames == 2);
  CHECK(last.lag_ms == Approx(40.0));
  for (std::size_t i = 0; i < hand.out.frames.size(); ++i) {
    CHECK(hand.out.frames[i].header.sequence == i + 1);
  }
}

TEST_CASE("silence and the end release the frames that wait; then the stream is stale") {
  Hand hand;
  hand.frames(20);
  hand.silence(90 * kMs);
  CHECK(hand.out.frames.size() == 18);
  hand.silence(100 * kMs);
  REQUIRE(hand.out.frames.size() == 20);
  CHECK(hand.out.frames.back().header.sequence == 20);
  CHECK(hand.out.frames.back().quality == Quality::kMeasured);
  hand.silence(400 * kMs);
  CHECK(hand.engine->state() == StreamState::kStale);
  CHECK(hand.out.frames.back().quality == Quality::kStale);
  hand.frames(10);
  CHECK(hand.engine->state() == StreamState::kLive);
  const std::size_t before_end = hand.out.frames.size();
  hand.engine->end(hand.now_ns, false, hand.out);
  CHECK(hand.out.frames.size() == before_end + 2);
  CHECK(hand.out.frames.back().header.sequence == 30);
}

TEST_CASE("a play shows labels from the acknowledged frame on, and then the live hand again") {
  Hand hand;
  hand.frames(20);
  const Ack ack = hand.play("1 p", 2.0);
  CHECK_FALSE(ack.refused);
  CHECK(ack.sequence == 19);
  REQUIRE(hand.out.decisions.size() == 1);
  CHECK(test::is_change(hand.out.decisions[0], generate::generate_type(),
                        StageChange::Kind::kCommand));
  CHECK(hand.out.decisions[0].sequence == 21);
  CHECK(hand.out.decisions[0].command.as<gesture::PlayOrder>().size == 2);
  hand.frames(300);
  for (const Frame& frame : hand.out.frames) {
    const bool performed = frame.source == Source::kLabels;
    if (frame.header.sequence < 19) CHECK_FALSE(performed);
    if (frame.header.sequence == 19) {
      CHECK(performed);
      CHECK(std::string(frame.label.data()) == "1");
      CHECK(frame.label_probability == 1.0F);
      CHECK(frame.quality == Quality::kMeasured);
    }
  }
  CHECK(hand.out.frames.back().source == Source::kDevice);
  CHECK(std::ranges::count(hand.out.events, v1::Event::KIND_PLAYING) == 1);
  CHECK(std::ranges::count(hand.out.events, v1::Event::KIND_PLAYED) == 1);
}

TEST_CASE("a performance continues while the device is silent, at the stream's rate") {
  Hand hand;
  hand.frames(20);
  static_cast<void>(hand.play("g p"));
  hand.silence(kNanosPerSecond);
  const std::size_t shown = hand.out.frames.size() - 20;
  CHECK(shown >= 40);
  CHECK(shown <= 52);
  CHECK(hand.out.frames.back().source == Source::kLabels);
  CHECK(hand.engine->state() == StreamState::kStale);
}

TEST_CASE("every frame has its own number, also those performed while the device is silent") {
  Hand hand;
  hand.frames(20);
  static_cast<void>(hand.play("g p"));
  hand.silence(kNanosPerSecond);
  CHECK(hand.out.frames.size() > 60);
  const Ack ack = hand.play("1");
  CHECK(ack.sequence == hand.out.frames.size() + 1);
  hand.frames(300);
  hand.silence(300 * kMs);  // all that waits has left
  for (std::size_t i = 0; i < hand.out.frames.size(); ++i) {
    REQUIRE(hand.out.frames[i].header.sequence == i + 1);
  }
  for (const Decision& decision : hand.out.decisions) CHECK(decision.sequence <= hand.sequence + 1);
}

TEST_CASE("the recorded ticks and plays give the same frames again") {
  Hand live;
  live.frames(30);
  static_cast<void>(live.play("c 3"));
  live.frames(10);
  live.silence(700 * kMs);
  live.frames(40);
  Hand again;  // a second engine, driven by the decisions alone
  std::size_t next = 0;
  const auto decided = [&](std::uint64_t before) {
    for (; next < live.out.decisions.size(); ++next) {
      const Decision& decision = live.out.decisions[next];
      if (decision.sequence > before) return;
      if (decision.kind == Decision::Kind::kTick) {
        again.now_ns = decision.now_ns;
        again.engine->tick_now(decision.now_ns, again.out);
      } else {
        static_cast<void>(again.engine->apply(
            {.change = decision.change, .stream = 1, .command = decision.command}, again.out));
      }
    }
  };
  for (int i = 1; i <= 80; ++i) {
    decided(std::uint64_t(i));
    if (i == 41) again.now_ns = 40 * kPeriod_ns + 700 * kMs;
    again.frames(1);
  }
  REQUIRE(again.out.frames.size() == live.out.frames.size());
  for (std::size_t i = 0; i < live.out.frames.size(); ++i) {
    CHECK(again.out.frames[i].angle_rad == live.out.frames[i].angle_rad);
    CHECK(again.out.frames[i].header.arrival_ns == live.out.frames[i].header.arrival_ns);
    CHECK(again.out.frames[i].header.sequence == live.out.frames[i].header.sequence);
  }
}

}  // namespace posed::pipeline
