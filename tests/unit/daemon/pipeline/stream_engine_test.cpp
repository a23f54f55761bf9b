#include <catch2/catch.hpp>

#include <vector>

#include "daemon/pipeline/stream_engine.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/support/ms.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::pipeline {
namespace {

using test::kMs;

class CollectedItems final : public EngineOut {
 public:
  void item(const Item& item) noexcept override { items.push_back(item); }
  void decision(const Decision& decision) noexcept override { decisions.push_back(decision); }

  // The frames that were published.
  [[nodiscard]] std::vector<Frame> frames(Item::Kind kind = Item::Kind::kFrame) const {
    std::vector<Frame> found;
    for (const Item& item : items) {
      if (item.kind == kind) found.push_back(item.frame);
    }
    return found;
  }
  [[nodiscard]] std::vector<int> events() const {
    std::vector<int> found;
    for (const Item& item : items) {
      if (item.kind == Item::Kind::kEvent) found.push_back(item.stream_event.kind);
    }
    return found;
  }

  std::vector<Item> items;
  std::vector<Decision> decisions;
};

Frame frame_at(std::uint64_t sequence, std::int64_t arrival_ns) {
  Frame frame;
  frame.header.sequence = sequence;
  frame.header.arrival_ns = arrival_ns;
  frame.joint_count = 1;
  return frame;
}

EngineOptions plain() {
  EngineOptions options;
  options.stream = 3;
  options.stale_after_ns = 100 * kMs;
  return options;
}

}  // namespace

TEST_CASE("without a style stage frames pass unchanged") {
  StreamEngine engine(plain());
  CollectedItems out;
  CHECK(engine.state() == StreamState::kWaiting);
  CHECK(engine.next_tick_ns() == kNoTime_ns);
  engine.on_frame(frame_at(1, 10 * kMs), out);
  CHECK(engine.state() == StreamState::kLive);
  REQUIRE(out.frames().size() == 1);
  CHECK(out.frames()[0].header.sequence == 1);
  CHECK(out.events() == std::vector<int>{v1::Event::KIND_STARTED});
  CHECK(out.decisions.empty());
}

TEST_CASE("the raw input goes out before the styled frame") {
  EngineOptions options = plain();
  options.publish_raw = true;
  StreamEngine engine(std::move(options));
  CollectedItems out;
  engine.on_frame(frame_at(1, 0), out);
  REQUIRE(out.items.size() == 3);
  CHECK(out.items[1].kind == Item::Kind::kRawFrame);
  CHECK(out.items[2].kind == Item::Kind::kFrame);
}

TEST_CASE("the event of a change names the old and the new value") {
  const auto model = test::toy_model(1);
  const auto skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  EngineOptions options = plain();
  const auto one = style::bind_model(model, *skeleton, "one.style").value();
  const auto two = style::bind_model(model, *skeleton, "two.style").value();
  options.stages.push_back(test::style_stage(one.get()));
  StreamEngine engine(std::move(options));
  CollectedItems out;
  static_cast<void>(engine.apply(test::alpha_command(3, 0.5), out));
  REQUIRE(out.items.size() == 1);
  StreamEvent change = out.items[0].stream_event;
  CHECK(change.kind == v1::Event::KIND_CONTROL);
  CHECK(change.change.index == test::parameter_index(style::style_type(), "alpha"));
  CHECK(change.value_before == 1.0);
  CHECK(change.change.value == 0.5);
  CHECK(engine.live_parameter(0).target == 0.5);
  CHECK(engine.live_parameter(0).now == 0.0);  // alpha moves towards its target with the frames
  static_cast<void>(engine.apply(test::model_command(3, style::style_type(), two.get()), out));
  change = out.items[1].stream_event;
  CHECK(change.change.kind == StageChange::Kind::kModel);
  CHECK(change.before.text() == "one.style");
  CHECK(change.after.text() == "two.style");
}

TEST_CASE("a gap in the sequence is recorded as shed, before the frame after it") {
  StreamEngine engine(plain());
  CollectedItems out;
  engine.on_frame(frame_at(1, 0), out);
  engine.on_frame(frame_at(5, 40 * kMs), out);
  REQUIRE(out.decisions.size() == 1);
  CHECK(out.decisions[0].kind == Decision::Kind::kShed);
  CHECK(out.decisions[0].stream == 3);
  CHECK(out.decisions[0].sequence == 2);
  CHECK(out.decisions[0].count == 3);
  CHECK(out.events() == std::vector<int>{v1::Event::KIND_STARTED, v1::Event::KIND_SHED});
  CHECK(out.items.back().frame.header.sequence == 5);
}

TEST_CASE("a silent stream turns stale, repeats its pose once a second, and recovers by itself") {
  StreamEngine engine(plain());
  CollectedItems out;
  engine.on_frame(frame_at(7, 0), out);
  out.decisions.clear();
  CHECK(engine.next_tick_ns() == 100 * kMs);
  CHECK_FALSE(engine.tick(99 * kMs, out));
  CHECK(out.decisions.empty());
  CHECK(engine.tick(100 * kMs, out));
  CHECK(engine.state() == StreamState::kStale);
  CHECK_FALSE(engine.tick(101 * kMs, out));
  CHECK(engine.tick(1100 * kMs, out));
  const auto frames = out.frames();
  REQUIRE(frames.size() == 3);
  CHECK(frames[0].quality == Quality::kMeasured);
  for (const std::size_t held : {1U, 2U}) {
    CHECK(frames[held].quality == Quality::kStale);
    CHECK(frames[held].header.sequence == 7);
    CHECK(frames[held].header.arrival_ns == 0);
  }
  REQUIRE(out.decisions.size() == 2);
  CHECK(out.decisions[0].kind == Decision::Kind::kTick);
  CHECK(out.decisions[0].now_ns == 100 * kMs);
  engine.on_frame(frame_at(8, 1200 * kMs), out);
  CHECK(engine.state() == StreamState::kLive);
  CHECK(out.frames().back().quality == Quality::kMeasured);
  CHECK(out.events().back() == v1::Event::KIND_RECOVERED);
}

TEST_CASE("a source that has ended is not stale") {
  StreamEngine engine(plain());
  CollectedItems out;
  engine.on_frame(frame_at(1, 0), out);
  engine.end(10 * kMs, false, out);
  CHECK(engine.state() == StreamState::kEnded);
  CHECK(engine.next_tick_ns() == kNoTime_ns);
  CHECK_FALSE(engine.tick(kNanosPerSecond, out));
  CHECK(out.events().back() == v1::Event::KIND_ENDED);
}

TEST_CASE("samples keep a stream alive and pass through") {
  StreamEngine engine(plain());
  CollectedItems out;
  Sample sample;
  sample.header.arrival_ns = 5 * kMs;
  sample.value_count = 2;
  engine.on_sample(sample, out);
  CHECK(engine.next_tick_ns() == 105 * kMs);
  REQUIRE(out.items.back().kind == Item::Kind::kSample);
  CHECK(out.items.back().sample.value_count == 2);
  // There is no pose to repeat: only the event.
  CHECK(engine.tick(105 * kMs, out));
  CHECK(out.frames().empty());
}

TEST_CASE("alpha and model take effect at the next frame; the old model comes back") {
  const Skeleton skeleton = test::toy_skeleton();
  const auto first = style::bind_model(test::toy_model(1), skeleton, "first").value();
  const auto second = style::bind_model(test::toy_model(2), skeleton, "second").value();
  EngineOptions options = plain();
  options.stages.push_back(test::style_stage(first.get()));
  StreamEngine engine(std::move(options));
  const clip::Clip walk = test::toy_walk(10);
  CollectedItems out;
  for (int i = 0; i < 5; ++i) {
    Frame frame = walk.frame(i);
    frame.header.sequence = static_cast<std::uint64_t>(i) + 1;
    engine.on_frame(frame, out);
  }
  const Ack swapped =
      engine.apply(test::model_command(3, style::style_type(), second.get(), 9), out);
  CHECK(swapped.ticket == 9);
  CHECK(swapped.sequence == 6);
  CHECK(engine.find(style::style_type())->model() == second.get());
  const Ack faded = engine.apply(test::alpha_command(3, 0.25, 10), out);
  CHECK(faded.sequence == 6);
  REQUIRE(out.decisions.size() == 2);
  CHECK(test::is_change(out.decisions[0], style::style_type(), StageChange::Kind::kModel));
  CHECK(test::is_change(out.decisions[1], style::style_type(), StageChange::Kind::kSet));
  CHECK(out.decisions[1].change.value == 0.25);
  CHECK(out.decisions[1].sequence == 6);
}

}  // namespace posed::pipeline
