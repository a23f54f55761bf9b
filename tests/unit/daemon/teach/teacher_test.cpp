// A teacher with frames of synthetic walkers: it learns as training from files does, one stream at
// a time, and gives up when it is told.
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <malloc.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/teach/teacher.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/gp/regression.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/style_model.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/time.hpp"
#include "tests/support/has.hpp"

namespace posed::teach {
namespace {

using motion::WalkerFamily;
using test::has;

constexpr double kWalk_s = 10.0;
constexpr std::uint32_t kStream = 7;

std::atomic<std::int64_t> now_ns{kNanosPerSecond};
std::int64_t clock_of_test() noexcept { return now_ns; }

clip::Clip walk_of(WalkerFamily family) {
  return motion::make_walker({.family = family, .seconds = kWalk_s}).value();
}

struct School {
  std::vector<std::string> kept;
  std::atomic<int> calls{0};
  Teacher teacher{
      [this](Subject subject, const std::string& name, std::string_view) {
        kept.push_back(name);
        return Result<std::string>(name + (subject == Subject::kStyle ? ".style" : ".gesture"));
      },
      [this] { ++calls; }, clock_of_test};

  // Marks this take of a hand as a show.
  v1::Teaching show(const clip::HandClip& take, const std::string& label) {
    const Skeleton hand = hand_skeleton(Side::kRight);
    const Pupil pupil{kStream, "hand", std::make_shared<const Skeleton>(hand)};
    REQUIRE(teacher.show(pupil, label, kMaxShow_s));
    for (std::size_t i = 0; i < take.angles.size(); ++i) {
      Frame frame;
      set_hand_angles(hand, take.angles[i], frame);
      frame.skeleton = hand.id;
      frame.header.stream = kStream;
      frame.header.device_ns = kNoTime_ns;
      frame.header.arrival_ns = now_ns + static_cast<std::int64_t>(take.time_s[i] * 1e9);
      teacher.raw_frame(frame);
    }
    now_ns += static_cast<std::int64_t>((kMaxShow_s + 1.0) * 1e9);
    return await();
  }

  static Pupil pupil(const clip::Clip& clip, const std::string& name = "walker") {
    return {.stream = kStream, .name = name, .skeleton = clip.skeleton};
  }

  // The state once what is under way is over.
  v1::Teaching await() {
    while (true) {
      v1::Teaching now = teacher.state();
      if (now.step() == v1::Teaching::STEP_IDLE || now.step() == v1::Teaching::STEP_STARTING) {
        return now;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  // Marks this clip as a walk, among frames of others, and one behind its end.
  // Slower where a busy machine could not keep what came.
  v1::TaughtWalk mark(const clip::Clip& clip, Walk walk, bool more = false) {
    std::chrono::milliseconds pause{70};
    while (true) {
      auto walked = mark(clip, walk, more, pause);
      pause *= 2;
      if (more || pause > std::chrono::seconds(1)) return walked;
      if (!has(walked.sentence(), "came faster")) return walked;
    }
  }
  v1::TaughtWalk mark(const clip::Clip& clip, Walk walk, bool more,
                      std::chrono::milliseconds pause) {
    REQUIRE(teacher.mark(pupil(clip), walk, kWalk_s, more));
    const std::int64_t from_ns = now_ns;
    for (int i = 0; i <= clip.frames(); ++i) {
      // Of a long clip the teacher takes what waits before its ring is full.
      if (i % 256 == 255) std::this_thread::sleep_for(pause);
      Frame frame = clip.frame(std::min(i, clip.frames() - 1));
      frame.skeleton = clip.skeleton->id;
      frame.header.device_ns = kNoTime_ns;
      frame.header.arrival_ns =
          from_ns + static_cast<std::int64_t>(i * 1e9 / clip.frame_rate_hz + 0.5);
      if (i == clip.frames()) frame.header.arrival_ns = from_ns + std::int64_t{10'000'000'000};
      frame.header.stream = kStream + 1;
      teacher.raw_frame(frame);
      frame.header.stream = kStream;
      teacher.raw_frame(frame);
    }
    const v1::Teaching done = await();
    return walk == Walk::kNeutral ? done.neutral_walk() : done.style_walk();
  }
};

style::TrainingClip lesson(clip::Clip clip, const std::string& group) {
  return {.clip = std::move(clip), .group = group, .subject = "one person", .motion = "walk"};
}

// What is said of this clip as a walk.
std::string walk_sentence(const clip::Clip& clip) {
  School school;
  return school.mark(clip, Walk::kNeutral).sentence();
}

}  // namespace

TEST_CASE("a style that is taught live is the one that training on its walks learns", "[teach]") {
  School school;
  const clip::Clip march = walk_of(WalkerFamily::kMarch);
  const clip::Clip sway = walk_of(WalkerFamily::kSway);
  const auto early = school.teacher.train("walker", "sway");
  REQUIRE_FALSE(early);
  CHECK(has(early.error().message, "no good walk as usual"));
  const auto usual = school.mark(march, Walk::kNeutral);
  INFO(usual.sentence());
  CHECK(usual.good());
  CHECK_FALSE(school.teacher.train("walker", "sway"));
  CHECK(school.mark(sway, Walk::kStyle).good());
  const clip::Clip more = motion::make_walker({.seconds = kWalk_s, .noise_deg = 0.4}).value();
  CHECK(school.mark(more, Walk::kNeutral, true).takes() == 2);
  REQUIRE(school.teacher.train("walker", "sway"));
  const v1::Teaching learnt = school.await();
  INFO(learnt.problem());
  REQUIRE(learnt.step() == v1::Teaching::STEP_STARTING);
  CHECK(school.calls == 1);
  const auto taught = school.teacher.take_model();
  REQUIRE(taught);
  CHECK(taught->stream == "walker");
  CHECK(taught->file == "sway.style");
  CHECK_FALSE(school.teacher.take_model());
  school.teacher.started(300);
  CHECK(school.teacher.state().step() == v1::Teaching::STEP_IN_USE);
  CHECK(school.teacher.state().sequence() == 300);

  const auto live = style::parse_model(std::as_bytes(std::span(taught->bytes)), "live").value();
  style::TrainOptions options;
  options.target = "sway";
  options.dataset.space = motion::Space::kHumanoid;
  const auto offline =
      style::train_style(
          {lesson(march, "as usual"), lesson(more, "as usual"), lesson(sway, "sway")}, options)
          .value();
  const auto report = nlohmann::json::parse(live.report_json);
  CHECK(report.at("clips").size() == 3);
  REQUIRE(live.process.inputs.cols() == offline.process.inputs.cols());
  const Eigen::MatrixXd asked = offline.process.inputs;
  const Eigen::MatrixXd wanted = gp::posterior_mean(offline.process, asked);
  const Eigen::MatrixXd got = gp::posterior_mean(live.process, asked);
  CHECK((got - wanted).norm() < 0.02 * wanted.norm());
}

TEST_CASE("of a fast stream as much is kept as training needs, and the same is learnt", "[teach]") {
  const auto in_use = [] {
    const struct mallinfo2 now = mallinfo2();
    return now.uordblks + now.hblkhd;
  };
  School school;
  const auto fast = [](WalkerFamily family) {
    return motion::make_walker({.family = family, .seconds = kWalk_s, .rate_hz = 480.0}).value();
  };
  const clip::Clip march = fast(WalkerFamily::kMarch), sway = fast(WalkerFamily::kSway);
  const std::size_t before = in_use();
  const auto usual = school.mark(march, Walk::kNeutral);
  INFO(usual.sentence());
  CHECK(usual.good());
  CHECK(usual.sentence() == walk_sentence(walk_of(WalkerFamily::kMarch)));
  CHECK(school.mark(sway, Walk::kStyle).good());
  const auto values = static_cast<std::size_t>(march.channels.size() + sway.channels.size());
  CHECK(in_use() < before + values * sizeof(double) / 3);
  REQUIRE(school.teacher.train("walker", "sway"));
  CHECK(school.await().step() == v1::Teaching::STEP_STARTING);
}

TEST_CASE("a spoilt walk is refused in words, and its stream can walk again", "[teach]") {
  School school;
  clip::Clip still = walk_of(WalkerFamily::kMarch);
  for (int i = 1; i < still.frames(); ++i) still.channels.row(i) = still.channels.row(0);
  const auto refused = school.mark(still, Walk::kNeutral);
  CHECK_FALSE(refused.good());
  CHECK(has(refused.sentence(), "no walk"));
  const clip::Clip march = walk_of(WalkerFamily::kMarch);
  REQUIRE(school.teacher.mark(School::pupil(march), Walk::kNeutral, kWalk_s));
  now_ns += static_cast<std::int64_t>((kWalk_s + 1.0) * 1e9);  // the device is silent
  CHECK(has(school.await().neutral_walk().sentence(), "no frames came"));
  CHECK(school.mark(march, Walk::kNeutral).good());
  // Two takes of one style: there is nothing to learn, and nothing is kept.
  const auto same = motion::make_walker({.seconds = kWalk_s, .noise_deg = 0.4}).value();
  CHECK(school.mark(same, Walk::kStyle).good());
  REQUIRE(school.teacher.train("walker", "same"));
  const v1::Teaching state = school.await();
  CHECK(state.step() == v1::Teaching::STEP_IDLE);
  CHECK(has(state.problem(), "no difference to learn"));
  CHECK(school.kept.empty());
}

TEST_CASE("more walks are learnt beside those before, and a refused one spoils none", "[teach]") {
  School school;
  const clip::Clip march = walk_of(WalkerFamily::kMarch);
  CHECK(school.mark(march, Walk::kNeutral).takes() == 1);
  CHECK(school.mark(walk_of(WalkerFamily::kSway), Walk::kStyle).takes() == 1);
  CHECK(school.mark(march, Walk::kNeutral, true).takes() == 2);
  clip::Clip still = march;
  for (int i = 1; i < still.frames(); ++i) still.channels.row(i) = still.channels.row(0);
  const auto refused = school.mark(still, Walk::kNeutral, true);
  CHECK_FALSE(refused.good());
  CHECK(refused.takes() == 2);
  CHECK(school.mark(still, Walk::kNeutral).takes() == 2);  // takes nobody's place
  CHECK(school.mark(march, Walk::kNeutral).takes() == 1);  // in the place of both
  clip::Clip cut = march;
  cut.channels.conservativeResize(march.frames() * 9 / 10, Eigen::NoChange);
  CHECK(has(school.mark(cut, Walk::kNeutral, true).sentence(), "silent for 1.0 s"));
}

TEST_CASE("a hand is taught signs, and keeps those that were shown well", "[teach]") {
  School school;
  const auto take = gesture::make_performance({.script = {"p", "1", "p"}}).value().clip;
  CHECK(has(school.teacher.train("hand", "signs", Subject::kSigns).error().message, "no sign"));
  for (std::size_t i = 0; i < gesture::kMinShows; ++i) {
    const auto shown = school.show(take, "one");
    INFO(shown.show().sentence());
    REQUIRE(shown.show().good());
    REQUIRE(shown.sign_size() == 1);
    CHECK(shown.sign(0).shows() == i + 1);
  }
  const auto alike = school.show(take, "uno");
  CHECK_FALSE(alike.show().good());
  CHECK(has(alike.show().sentence(), "like 'one'"));
  CHECK(alike.sign_size() == 1);
  const Pupil body = School::pupil(walk_of(WalkerFamily::kMarch));
  CHECK(has(school.teacher.show(body, "one", 5.0).error().message, "is no hand"));
  REQUIRE(school.teacher.train("hand", "signs", Subject::kSigns));
  const auto learnt = school.await();
  INFO(learnt.problem());
  REQUIRE(learnt.step() == v1::Teaching::STEP_STARTING);
  CHECK(has(learnt.verdict(), "knows one, rest from 3 shows"));
  CHECK(school.teacher.take_model()->file == "signs.gesture");
  school.teacher.started(1);
  CHECK(school.teacher.forget("hand", "one"));
  CHECK(school.teacher.state().sign_size() == 0);
}

TEST_CASE("one stream is taught at a time, until it is cancelled", "[teach]") {
  School school;
  const clip::Clip march = walk_of(WalkerFamily::kMarch);
  for (const double seconds : {0.0, 5.9, 121.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_FALSE(school.teacher.mark(School::pupil(march), Walk::kNeutral, seconds));
  }
  CHECK(school.mark(march, Walk::kNeutral).good());
  REQUIRE(school.teacher.mark(School::pupil(march), Walk::kStyle, kWalk_s));
  CHECK(school.teacher.state().seconds_left() == Approx(kWalk_s));
  const auto second = school.teacher.mark(School::pupil(march, "other"), Walk::kNeutral, kWalk_s);
  REQUIRE_FALSE(second);
  CHECK(has(second.error().message, "stream walker is being taught"));
  CHECK_FALSE(school.teacher.cancel("other"));
  CHECK(school.teacher.cancel("walker"));
  CHECK(school.teacher.state().neutral_walk().good());  // stays
  const auto over = school.teacher.mark(School::pupil(march, "other"), Walk::kNeutral, kWalk_s);
  REQUIRE_FALSE(over);
  CHECK(has(over.error().message, "lesson of stream walker is not finished"));
  CHECK(school.teacher.forget("walker", ""));
  CHECK(school.teacher.mark(School::pupil(march, "other"), Walk::kNeutral, kWalk_s));
  CHECK(school.teacher.state().neutral_walk().sentence().empty());
  // The daemon ends while a walk is marked.
}

}  // namespace posed::teach
