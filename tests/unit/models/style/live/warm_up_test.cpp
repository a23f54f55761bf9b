// The warm-up: what it measures, what the kernel then sees, and what ends it badly.
#include "models/style/live/warm_up.hpp"

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/style/live/style_filter.hpp"
#include "models/style/live/style_type.hpp"
#include "models/style/live/walker_tracker.hpp"
#include "posed/v1/log.pb.h"
#include "tests/support/last_frame.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

using namespace posed;
using namespace posed::test;
using style::WalkerTracker;
using style::WarmUp;

namespace {

std::unique_ptr<const style::BoundModel> warm_bound(const style::StyleModel& model) {
  return style::bind_model(model, toy_skeleton(), "toy").value();
}

Parameters completed(const std::vector<ParameterSpec>& specs, const Parameters& given) {
  auto all = complete_parameters(specs, given);
  REQUIRE(all);
  return *std::move(all);
}

// A stage that styles the toy's walk, `bend_rad` added to every joint but the root.
class WarmedToy {
 public:
  explicit WarmedToy(const style::BoundModel* model, const style::FilterOptions& options = {})
      : filter(model, options) {}

  bool warm_up(double seconds) {
    return filter.command(style::StyleFilter::kWarmUp, StageCommand::of(seconds));
  }
  Frame walk(int frames, double bend_rad = 0.0, std::int64_t later_ns = 0) {
    clip::Clip clip = toy_walk(next_ + frames);
    clip.channels.rightCols(12).array() += bend_rad;
    for (int i = 0; i < frames; ++i) {
      Frame in = clip.frame(next_++);
      in.header.device_ns += later_ns;
      filter.process({.frame = in}, last);
    }
    return last.out;
  }
  std::vector<std::size_t> notices() {
    std::vector<std::size_t> reported;
    while (const auto notice = filter.take_notice()) reported.push_back(notice->index);
    return reported;
  }
  style::StyleFilter filter;
  test::LastFrame last;

 private:
  int next_ = 0;
};

}  // namespace

TEST_CASE("a warm-up is the mean of the frames on which the walker walks", "[style]") {
  WarmUp warm_up;
  const std::vector<std::uint8_t> available{1, 1, 0};
  warm_up.begin(1.0);
  for (int i = 0; i < 9; ++i) {
    const bool walks = i % 3 != 0;
    const std::vector<float> q{walks ? 2.0F : 100.0F, static_cast<float>(i), 7.0F};
    REQUIRE(warm_up.update(q, available, {.walk = walks, .cadence_rad_s = 6.0}, 0.1) ==
            WarmUp::Outcome::kNone);
  }
  CHECK(warm_up.update(std::vector<float>(3, 2.0F), available, {.walk = true, .cadence_rad_s = 6.0},
                       0.11) == WarmUp::Outcome::kDone);
  const style::Walker walker = warm_up.walker();
  CHECK(walker.neutral[0] == Approx(2.0F));
  CHECK(walker.measured[1] == 1);
  CHECK(walker.measured[2] == 0);
  CHECK(walker.cadence_rad_s == Approx(6.0));
  CHECK_FALSE(warm_up.running());
  warm_up.begin(0.5);
  CHECK(warm_up.update(available.size() == 3 ? std::vector<float>(3) : std::vector<float>(),
                       available, {.cadence_rad_s = 6.0}, 0.6) == WarmUp::Outcome::kStood);
}

TEST_CASE("legs tell what belongs to their instant, and elsewhere the mean", "[style]") {
  const std::vector<std::uint16_t> legs{0, 1};
  style::PoseCycle cycle(style::kGridFrames, 3);
  for (int t = 0; t < style::kGridFrames; ++t) {
    const double phase = 2.0 * kPi * t / style::kGridFrames;
    cycle.row(t) << static_cast<float>(std::cos(phase)), static_cast<float>(std::sin(phase)),
        static_cast<float>(0.2 + 0.1 * std::cos(2.0 * phase));
  }
  style::LegMap map;
  map.fit(legs, cycle, cycle);
  const std::vector<std::uint8_t> all(3, 1);
  std::vector<float> does(3);
  for (const Eigen::Index t : {0, 9, 20}) {
    map.get(std::vector<float>{cycle(t, 0), cycle(t, 1), 9.0F}, all, does);
    CHECK(does[2] == Approx(cycle(t, 2)).margin(0.01));
  }
  map.get(std::vector<float>{50.0F, 50.0F, 0.0F}, all, does);
  CHECK(does[2] == Approx(0.2).margin(1e-3));
  map.get(std::vector<float>(3), std::vector<std::uint8_t>{0, 0, 1}, does);
  CHECK(does[2] == Approx(0.2).margin(1e-3));
}

TEST_CASE("a walker's cycle survives the command and its log", "[style]") {
  style::Walker walker;
  walker.cycle.resize(style::kGridFrames, 3);
  for (int d = 0; d < 3; ++d) {
    walker.measured[static_cast<std::size_t>(d)] = 1;
    for (int t = 0; t < style::kGridFrames; ++t) {
      walker.cycle(t, d) = static_cast<float>(0.5 * std::cos(2.0 * kPi * t / 28 + d));
    }
  }
  v1::DecisionValue logged;
  style::walker_to_log(style::command_of(walker), logged);
  const auto read = style::walker_from_log(logged);
  REQUIRE(read);
  const style::Walker back = style::walker_of(*read);
  CHECK((back.cycle.leftCols(3) - walker.cycle).cwiseAbs().maxCoeff() < 0.01F);
  CHECK(std::isnan(back.cycle(0, 3)));
}

TEST_CASE("after a warm-up the kernel sees the walker as if its neutral pose were the training's",
          "[style]") {
  const auto ready = warm_bound(gated_toy_model(1));
  WarmedToy plain(ready.get());
  WarmedToy warmed(ready.get());
  REQUIRE(warmed.warm_up(4.0));
  const Frame wanted = plain.walk(600);
  const Frame got = warmed.walk(600, 0.15);
  CHECK(warmed.notices() == std::vector<std::size_t>{WalkerTracker::kWarmedUp});
  REQUIRE(warmed.filter.walker());
  WarmedToy unwarmed(ready.get());
  const Frame without = unwarmed.walk(600, 0.15);
  const clip::Clip walk = toy_walk(600);
  clip::Clip bent = walk;
  bent.channels.rightCols(12).array() += 0.15;
  double error = 0.0;
  double error_without = 0.0;
  for (int j = 1; j < 5; ++j) {
    const auto right = delta_of(walk.frame(599), wanted, j);
    error += angle_between_rad(delta_of(bent.frame(599), got, j), right);
    error_without += angle_between_rad(delta_of(bent.frame(599), without, j), right);
  }
  CHECK(error < 0.6 * error_without);
}

TEST_CASE("an interrupted warm-up leaves what was known", "[style]") {
  const auto ready = warm_bound(gated_toy_model(1));
  WarmedToy toy(ready.get());
  REQUIRE(toy.warm_up(2.0));
  toy.walk(180);
  REQUIRE(toy.filter.walker());
  const auto before = toy.filter.walker()->neutral;
  REQUIRE(toy.warm_up(2.0));
  toy.walk(60, 0.2);
  toy.walk(120, 0.2, 2'000'000'000);  // a gap of two seconds
  CHECK(toy.notices() ==
        std::vector<std::size_t>{WalkerTracker::kWarmedUp, WalkerTracker::kInterrupted});
  REQUIRE(toy.filter.walker());
  CHECK(toy.filter.walker()->neutral == before);
  REQUIRE(toy.warm_up(2.0));
  toy.filter.flush(toy.last);
  CHECK(toy.notices() == std::vector<std::size_t>{WalkerTracker::kInterrupted});
}

TEST_CASE("a model of an older posed has neither gate nor warm-up, and says so once", "[style]") {
  const auto old = warm_bound(toy_model(1));
  WarmedToy toy(old.get());
  CHECK_FALSE(toy.warm_up(2.0));
  const Frame out = toy.walk(90);
  CHECK(toy.notices() == std::vector<std::size_t>{WalkerTracker::kNoGateData});
  CHECK(std::isnan(toy.filter.reading(style::StyleFilter::kStyleGate)));
  WarmedToy ungated(old.get(), {.gate = false});
  CHECK(delta_of(ungated.walk(90), out, 2).angularDistance(Eigen::Quaterniond::Identity()) < 1e-6);
  CHECK(ungated.notices().empty());
  WarmedToy unreceived(old.get(), {.gate = false, .auto_alpha = true});
  unreceived.walk(90);
  CHECK(unreceived.notices() == std::vector<std::size_t>{WalkerTracker::kNoAxis});
  CHECK_FALSE(unreceived.warm_up(2.0));
  CHECK(unreceived.notices() == std::vector<std::size_t>{WalkerTracker::kNoGateData});
}

TEST_CASE("a walker goes into a command, into the log and back within half of 1e-4 rad",
          "[style]") {
  style::Walker walker;
  for (std::size_t d = 0; d < 15; d += 2) {
    walker.neutral[d] = 0.37F * static_cast<float>(d) - 3.0F;
    walker.measured[d] = 1;
  }
  const StageCommandType& type = style::style_type().commands[style::StyleFilter::kNeutral];
  for (const double cadence_rad_s : {6.5, std::nan("")}) {
    walker.cadence_rad_s = cadence_rad_s;
    const StageCommand command = style::command_of(walker);
    v1::DecisionValue value;
    type.to_log(command, value);
    const auto back = type.from_log(value);
    REQUIRE(back);
    CHECK(back->bytes == command.bytes);
    const style::Walker found = style::walker_of(*back);
    CHECK(found.measured == walker.measured);
    for (std::size_t d = 0; d < 15; ++d) {
      CHECK(std::abs(found.neutral[d] - walker.neutral[d]) <= 0.51e-4F);
    }
    CHECK(std::isnan(found.cadence_rad_s) == std::isnan(cadence_rad_s));
    v1::DecisionValue broken = value;
    broken.mutable_walker()->add_dimension(3);
    CHECK_FALSE(type.from_log(broken));  // without an angle
    broken.mutable_walker()->add_angle(40'000);
    CHECK_FALSE(type.from_log(broken));
    broken.mutable_walker()->set_angle(broken.walker().angle_size() - 1, 1);
    CHECK(type.from_log(broken));
    broken.mutable_walker()->set_dimension(0, 3);  // twice
    CHECK_FALSE(type.from_log(broken));
    broken.mutable_walker()->set_dimension(0, 288);
    CHECK_FALSE(type.from_log(broken));
  }
  CHECK_FALSE(type.from_log({}));
  CHECK_FALSE(type.encode(nullptr, {}, {}));
}

TEST_CASE("a clip of the usual walk stands for a warm-up", "[style]") {
  const TempFolder folder;
  clip::Clip usual = toy_walk(600);
  usual.channels.rightCols(12).array() += 0.15;
  REQUIRE(clip::write_bvh(usual, folder.path() / "ann.bvh"));
  const style::StyleModel model = gated_toy_model(1);
  const std::string file = style::serialize_model(model);
  const auto ready = warm_bound(model);
  const auto& type = style::style_type();
  const auto first = [&](const std::string& name) {
    Parameters given = completed(type.parameters, {});
    given["neutral"] = (folder.path() / name).string();
    return type.first_command(given, ready.get(), std::as_bytes(std::span(file)));
  };
  const auto command = first("ann.bvh");
  REQUIRE(command);
  REQUIRE(*command);
  WarmedToy known(ready.get());
  REQUIRE(known.filter.command((*command)->index, (*command)->command));
  WarmedToy warmed(ready.get());
  REQUIRE(warmed.warm_up(4.0));
  const Frame wanted = warmed.walk(600, 0.15);
  CHECK(delta_of(wanted, known.walk(600, 0.15), 2).angularDistance(Eigen::Quaterniond::Identity()) <
        0.02);
  const auto missing = first("none.bvh");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().file.ends_with("none.bvh"));
  Parameters both = completed(type.parameters, {});
  both["neutral"] = std::string("a.bvh");
  both["warm_up_s"] = 5.0;
  REQUIRE(type.check(both, true));
  CHECK(type.check(both, true)->parameter == "neutral");
}

TEST_CASE("alpha acts while auto-alpha does not know how much the walker shows", "[style]") {
  const auto ready = warm_bound(gated_toy_model(1));
  WarmedToy toy(ready.get());
  toy.walk(90);
  REQUIRE(toy.filter.alpha() == 1.0F);
  toy.filter.set(test::parameter_index(style::style_type(), "auto_alpha"), 1.0);
  const auto next = warm_bound(gated_toy_model(2));
  REQUIRE(toy.filter.use(next.get()));  // forgets the estimate
  REQUIRE(std::isnan(toy.filter.reading(style::StyleFilter::kStyleEstimate)));
  toy.filter.set_alpha(0.0F);
  toy.walk(20);
  REQUIRE(std::isnan(toy.filter.reading(style::StyleFilter::kStyleEstimate)));
  CHECK(toy.filter.alpha() < 0.4F);
}

TEST_CASE("a walker stays known when a model with other mean rotations is swapped in", "[style]") {
  const auto first = warm_bound(gated_toy_model(1));
  style::StyleModel turned = gated_toy_model(1);
  const Eigen::Quaterniond turn = rotation_exp(Eigen::Vector3d(0.1, -0.2, 0.3));
  turned.space.mean[2] = turned.space.mean[2] * turn;
  const auto second = warm_bound(turned);
  WarmedToy toy(first.get());
  REQUIRE(toy.warm_up(2.0));
  toy.walk(180);
  const auto before = toy.filter.walker()->neutral;
  REQUIRE(toy.filter.use(second.get()));
  REQUIRE(toy.filter.walker());
  const auto& after = toy.filter.walker()->neutral;
  const auto of = [](const auto& q, std::size_t d) {
    return rotation_exp(Eigen::Vector3d(q[d], q[d + 1], q[d + 2]));
  };
  CHECK(after[3] == before[3]);
  CHECK(angle_between_rad(turn * of(after, 6), of(before, 6)) < 1e-5);
  static_cast<void>(toy.notices());
  const auto old = warm_bound(toy_model(2));
  REQUIRE(toy.filter.use(old.get()));
  toy.walk(1);
  CHECK_FALSE(toy.filter.walker());
  CHECK(toy.notices() == std::vector<std::size_t>{WalkerTracker::kNoGateData});
}

TEST_CASE("the warm-up command goes into the log and back; what it cannot be is refused",
          "[style]") {
  const StageCommandType& type = style::style_type().commands[style::StyleFilter::kWarmUp];
  const auto ready = warm_bound(gated_toy_model(1));
  const auto options = completed(type.options, {{"seconds", 7.5}});
  const auto command = type.encode(ready.get(), {}, options);
  REQUIRE(command);
  v1::DecisionValue value;
  type.to_log(*command, value);
  const auto back = type.from_log(value);
  REQUIRE(back);
  CHECK(back->as<double>() == 7.5);
  for (const double wrong : {0.0, -3.0, 1e9, std::nan("")}) {
    value.set_number(wrong);
    CHECK_FALSE(type.from_log(value));
  }
  CHECK_FALSE(type.encode(nullptr, {}, options));
  const std::vector<std::string> words{"now"};
  CHECK_FALSE(type.encode(ready.get(), words, options));
  const auto short_one = complete_parameters(style::style_type().parameters, {{"warm_up_s", 1.0}});
  CHECK(style::style_type().check(*short_one, true)->parameter == "warm_up_s");
}

TEST_CASE("the estimate is the mean of the last second, at any rate", "[style]") {
  for (const double rate_hz : {24.0, 30.0, 500.0}) {
    style::StyleEstimate estimate;
    CHECK(std::isnan(estimate.value()));
    for (int i = 0; i < 3.0 * rate_hz; ++i) {
      const double wave = std::sin(2.0 * kPi * i / rate_hz);
      estimate.update((i < rate_hz ? 5.0 : 0.7) + wave, 1.0 / rate_hz);
    }
    CHECK(estimate.value() == Approx(0.7).margin(0.08));
  }
}

TEST_CASE("auto-alpha gives the style that the walker does not show yet", "[style]") {
  style::StyleModel model = gated_toy_model(1);
  const auto alpha_for = [&](double shown) {
    model.axis = {Eigen::VectorXd::Zero(15), shown};
    const auto ready = warm_bound(model);
    WarmedToy toy(ready.get(), {.alpha = 0.8, .auto_alpha = true});
    toy.walk(20);
    CHECK(toy.filter.alpha() == 0.0F);  // not known yet
    toy.walk(160);
    CHECK(toy.filter.reading(style::StyleFilter::kStyleEstimate) == Approx(shown));
    return static_cast<double>(toy.filter.alpha());
  };
  CHECK(alpha_for(0.0) == Approx(0.8));
  CHECK(alpha_for(-0.4) == Approx(0.8));
  CHECK(alpha_for(0.25) == Approx(0.6));
  CHECK(alpha_for(1.3) == 0.0);
}
