// Several styles in one model, and parts of the body: what weights and masks do to a live filter,
// the continuity bound while they move, and clear sentences for what makes no sense.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "models/style/live/style_filter.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/has.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test_mix {
namespace {

using style::Shares;
using test::delta_of;
using test::toy_skeleton;
using test::toy_styles;
using test::toy_walk;

constexpr int kJoints = 5;
constexpr double kRate = 120.0;

std::unique_ptr<const style::BoundModel> bound(const style::StyleModel& model) {
  return style::bind_model(model, toy_skeleton(), "toy").value();
}

Frame styled(style::StyleFilter& filter, const Frame& in) {
  test::LastFrame last;
  filter.process({.frame = in}, last);
  return last.out;
}

// Frame after frame of the same pose, in time.
class Still {
 public:
  Frame next() {
    frame_.header.device_ns = nanoseconds(++count_ / kRate);
    return frame_;
  }

 private:
  Frame frame_ = toy_walk(50).frame(10);
  int count_ = 0;
};

// The filter's output once everything has come to rest.
Frame rested(style::StyleFilter& filter) {
  Still still;
  Frame out;
  for (int i = 0; i < 240; ++i) out = styled(filter, still.next());
  return out;
}

Frame rested(const style::BoundModel& model, const style::FilterOptions& options = {}) {
  style::StyleFilter filter(&model, options);
  return rested(filter);
}

Shares shares(const std::string& text, const style::BoundModel& model) {
  return style::shares_of(text, model.styles()).value();
}

double largest_rad(const Frame& a, const Frame& b) {
  double largest = 0.0;
  for (int j = 0; j < kJoints; ++j) {
    largest =
        std::max(largest, angle_between_rad(delta_of(a, b, j), Eigen::Quaterniond::Identity()));
  }
  return largest;
}

bool same_rotations(const Frame& a, const Frame& b) {
  return std::equal(a.rotation_xyzw.begin(), a.rotation_xyzw.begin() + kJoints,
                    b.rotation_xyzw.begin());
}

std::string refusal(const Result<Shares>& result) {
  REQUIRE_FALSE(result);
  return result.error().message;
}

}  // namespace

TEST_CASE("a style alone in a mixture gives the bits of its own model", "[style]") {
  const auto both = bound(toy_styles({1, 2, 5}));
  for (const unsigned seed : {1U, 2U, 5U}) {
    const auto alone = bound(test::toy_model(seed));
    style::FilterOptions options;
    options.weights = "s" + std::to_string(seed) + "=1";
    CHECK(same_rotations(rested(*both, options), rested(*alone)));
  }
  CHECK(same_rotations(rested(*both), rested(*bound(test::toy_model(1)))));
}

TEST_CASE("a mixture that a filter glides to is the one that it starts with", "[style]") {
  const auto model = bound(toy_styles({1, 2, 5}));
  style::FilterOptions options;
  options.weights = "s2=3, s5=1";
  const Frame wanted = rested(*model, options);
  style::StyleFilter filter(model.get(), {});
  CHECK(largest_rad(rested(filter), wanted) > 0.05);
  REQUIRE(filter.set_shares(shares(options.weights, *model)));
  CHECK(same_rotations(rested(filter), wanted));
  const auto mixture =
      bound(style::mixture_of(toy_styles({1, 2, 5}), std::vector{0.0, 0.75, 0.25}));
  CHECK(largest_rad(rested(*mixture), wanted) < 1e-5);
}

TEST_CASE("weights on their way are between the styles, and take 1 / slew from one to the other",
          "[style]") {
  const auto model = bound(toy_styles({1, 2}));
  style::StyleFilter filter(model.get(), {});
  static_cast<void>(rested(filter));
  REQUIRE(filter.set_shares(shares("s2=1", *model)));
  Still still;
  static_cast<void>(styled(filter, still.next()));  // time runs from here
  const double begin = filter.weights().now().of[1];
  CHECK(begin < 0.1);
  for (int i = 1; i <= 60; ++i) {
    static_cast<void>(styled(filter, still.next()));
    CHECK(filter.weights().now().of[1] == Approx(std::min(1.0, begin + i / 60.0)));
    CHECK(filter.weights().now().of[0] + filter.weights().now().of[1] == Approx(1.0));
  }
  CHECK_FALSE(filter.weights().moving());
}

// angle(D(t-1), D(t)) <= |c| slew dt + the change of the model delta (style_filter.hpp). With one
// frame repeated and L the largest angle that a style alone gives a joint at alpha 1, that change
// is at most L slew dt by alpha, and at alpha 2 another 2 (2 L) slew dt by weights (from one style
// to the opposite one) and 2 L slew dt by the mask; |c| is at most 4 L.
TEST_CASE("swaps, alpha, weights and masks together never step above the slew", "[style]") {
  constexpr double kSlew = 2.0;
  constexpr double kStep = kSlew / kRate;
  std::vector<std::unique_ptr<const style::BoundModel>> models;
  double reach = 0.0;
  for (const auto& seeds : {std::vector{0U, 1U, 2U}, {2U, 3U}, {4U}, {1U, 2U, 5U, 6U}, {6U, 0U}}) {
    models.push_back(bound(toy_styles(seeds, 0.2)));
    for (const std::string& name : models.back()->styles()) {
      style::FilterOptions alone;
      alone.weights = name + "=1";
      reach = std::max(reach, largest_rad(Still().next(), rested(*models.back(), alone)));
    }
  }
  const double bound_rad = 1.05 * (4.0 + 1.0 + 4.0 + 2.0) * reach * kStep;
  std::mt19937 random(11);
  const style::BoundModel* model = models[0].get();
  style::StyleFilter filter(model, {});
  Still still;
  Frame before = still.next();
  static_cast<void>(styled(filter, before));
  double largest = 0.0;
  int moving = 0;
  for (int i = 0; i < 6000; ++i) {
    const bool swaps = random() % 40 == 0;
    if (swaps) {
      model = models[random() % models.size()].get();
      static_cast<void>(filter.set_model(model));
    }
    if (random() % 16 == 0) filter.set_alpha(static_cast<float>(random() % 401) / 100.0F - 2.0F);
    if (random() % 8 == 0) {
      std::string weights;
      for (const std::string& name : model->styles()) {
        weights += (weights.empty() ? "" : ",") + name + "=" + std::to_string(random() % 3);
      }
      const auto wanted = style::shares_of(weights, model->styles());
      if (wanted) CHECK(filter.set_shares(*wanted));
    }
    if (random() % 16 == 0) {
      style::Mask mask{};
      for (double& factor : mask) factor = static_cast<double>(random() % 5) / 4.0;
      filter.set_mask(mask);
    }
    const Shares shares_before = filter.weights().now();
    const style::Mask mask_before = filter.mask().now();
    const Frame in = still.next();
    const Frame out = styled(filter, in);
    double mixed = 0.0;
    for (std::size_t s = 0; s < style::kMaxStyles; ++s) {
      mixed += 0.5 * std::abs(filter.weights().now().of[s] - shares_before.of[s]);
    }
    CHECK(mixed <= kStep + 1e-8);
    for (std::size_t p = 0; p < style::kBodyParts; ++p) {
      CHECK(std::abs(filter.mask().now()[p] - mask_before[p]) <= kStep + 1e-8);
    }
    moving += filter.weights().moving() ? 1 : 0;
    for (int j = 0; j < kJoints; ++j) {
      largest = std::max(largest, angle_between_rad(delta_of(in, before, j), delta_of(in, out, j)));
    }
    before = out;
  }
  INFO("largest step " << largest << " rad, bound " << bound_rad);
  CHECK(largest <= bound_rad);
  CHECK(largest > 0.2 * bound_rad);
  CHECK(moving > 1000);
}

TEST_CASE("a mask takes the style from its parts alone, and half of it where it says so",
          "[style]") {
  const auto model = bound(test::toy_model(1));
  const Frame in = Still().next();
  const Frame all = rested(*model);
  style::FilterOptions options;
  options.mask = style::mask_of("legs=0,head=0.5").value();
  const Frame masked = rested(*model, options);
  const Skeleton skeleton = toy_skeleton();
  for (int j = 0; j < kJoints; ++j) {
    INFO(skeleton.joints[static_cast<std::size_t>(j)].name);
    const auto part = style::part_of_joint(skeleton, j);
    const double before = angle_between_rad(delta_of(in, all, j), Eigen::Quaterniond::Identity());
    const double after = angle_between_rad(delta_of(in, masked, j), Eigen::Quaterniond::Identity());
    REQUIRE(before > 0.01);
    if (part == style::BodyPart::kTrunk) CHECK(after == before);
    if (part == style::BodyPart::kHead) CHECK(after == Approx(0.5 * before).epsilon(0.1));
    if (part == style::BodyPart::kLeftLeg || part == style::BodyPart::kRightLeg)
      CHECK(after == 0.0);
  }
}

TEST_CASE("every joint belongs to a part of the body", "[style]") {
  const Skeleton skeleton = toy_skeleton();
  using style::BodyPart;
  const std::vector<BodyPart> wanted{BodyPart::kTrunk, BodyPart::kTrunk, BodyPart::kHead,
                                     BodyPart::kLeftLeg, BodyPart::kRightLeg};
  for (int j = 0; j < kJoints; ++j) {
    INFO(skeleton.joints[static_cast<std::size_t>(j)].name);
    CHECK(style::part_of_joint(skeleton, j) == wanted[static_cast<std::size_t>(j)]);
  }
}

TEST_CASE("weights stay with their styles when the model changes", "[style]") {
  const auto first = bound(toy_styles({1, 2, 3}));
  const auto second = bound(toy_styles({3, 4, 2}));
  const auto third = bound(toy_styles({7, 8}));
  style::FilterOptions options;
  options.weights = "s1=0.5,s2=0.3,s3=0.2";
  style::StyleFilter filter(first.get(), options);
  static_cast<void>(filter.set_model(second.get()));
  CHECK(filter.weights().target().of[0] == Approx(0.4));
  CHECK(filter.weights().target().of[1] == 0.0);
  CHECK(filter.weights().target().of[2] == Approx(0.6));
  CHECK_FALSE(filter.set_shares(style::first_alone(2)));  // made for another model
  CHECK(filter.weights().target().of[0] == Approx(0.4));
  static_cast<void>(filter.set_model(third.get()));
  CHECK(filter.weights().target().of[0] == 1.0);
  CHECK(filter.weights().target().count == 2);
}

TEST_CASE("a filter does not allocate while its weights and mask move", "[style]") {
  const auto a = bound(toy_styles({1, 2, 3}));
  const auto b = bound(toy_styles({3, 4}));
  style::StyleFilter filter(a.get(), {});
  const Shares towards = shares("s2=0.5,s3=0.5", *a);
  const auto command = StageCommand::of(towards);
  const auto mask = StageCommand::of(style::mask_of("arms=0.5").value());
  Still still;
  test::LastFrame last;
  std::uint64_t taken = 0;
  for (int i = 0; i < 200; ++i) {
    const Frame in = still.next();
    const std::uint64_t before = test::allocations();
    if (i == 20) CHECK(filter.command(style::StyleFilter::kWeights, command));
    if (i == 40) CHECK(filter.command(style::StyleFilter::kMask, mask));
    if (i == 60) static_cast<void>(filter.set_model(b.get()));
    ShortText text;
    filter.describe(style::StyleFilter::kWeights, command, text);
    filter.process({.frame = in}, last);
    taken += test::allocations() - before;
  }
  CHECK(taken == 0);
}

TEST_CASE("weights and masks that make no sense are refused with a sentence", "[style]") {
  const std::vector<std::string> styles{"feminine", "elderly"};
  const auto wrong = [&](const std::string& text) {
    return refusal(style::shares_of(text, styles));
  };
  CHECK(test::has(wrong("sad=1"), "no style 'sad'; it has: feminine, elderly"));
  CHECK(test::has(wrong("feminine=0,elderly=0"), "all are 0"));
  CHECK(test::has(wrong("feminine=-1"), "from 0 to 1000"));
  CHECK(test::has(wrong("feminine=nan"), "from 0 to 1000"));
  CHECK(test::has(wrong("feminine=inf"), "from 0 to 1000"));
  CHECK(test::has(wrong("feminine=1e300"), "from 0 to 1000"));
  CHECK(test::has(wrong("feminine=1,feminine=2"), "'feminine' is named twice"));
  CHECK(test::has(wrong("feminine"), "is not NAME=NUMBER"));
  CHECK(test::has(wrong("feminine=1,"), "is not NAME=NUMBER"));
  CHECK(test::has(wrong("=1"), "is not NAME=NUMBER"));
  CHECK(test::has(wrong(std::string(5000, 'a')), "bytes"));
  CHECK(style::shares_of("", styles)->of[0] == 1.0);
  CHECK(style::shares_of("elderly=2", styles)->of[1] == 1.0);
  CHECK(style::shares_of(" feminine = 0.6 , elderly = 0.4 ", styles)->of[1] == Approx(0.4));

  CHECK(test::has(style::mask_of("tail=1").error().message,
                  "no part 'tail'; it has: arms, legs, trunk"));
  CHECK(test::has(style::mask_of("arms=1.5").error().message, "from 0 to 1"));
  CHECK(test::has(style::mask_of("arms=1,arms=0").error().message, "named twice"));
  CHECK(style::mask_of("").value() == style::whole_body());
}

TEST_CASE("weights and masks read back as people write them", "[style]") {
  const std::vector<std::string> styles{"feminine", "elderly"};
  ShortText text;
  style::describe_shares(style::shares_of("elderly=3,feminine=2", styles).value(), styles, text);
  CHECK(text.text() == "feminine=0.4,elderly=0.6");
  ShortText part;
  style::describe_mask(style::mask_of("arms=0.5,head=0").value(), part);
  CHECK(part.text() == "head=0,left-arm=0.5,right-arm=0.5");
}

}  // namespace posed::test_mix
