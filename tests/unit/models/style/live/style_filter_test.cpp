// The style stage on a toy body: what it adds, what it does not change, and the continuity bound.
#include "models/style/live/style_filter.hpp"

#include <cstring>
#include <random>

#include <catch2/catch.hpp>

#include "tests/support/allocations.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/unit/models/style/toy_style.hpp"

using namespace posed;
using namespace posed::test;

namespace {

constexpr int kJoints = 5;

Frame run(style::StyleFilter& filter, const Frame& in) {
  test::LastFrame last;
  filter.process({.frame = in}, last);
  REQUIRE(last.count == 1);
  return last.out;
}

std::unique_ptr<const style::BoundModel> bound(const style::StyleModel& model) {
  return style::bind_model(model, toy_skeleton(), "toy").value();
}

std::unique_ptr<const style::BoundModel> bound(unsigned seed, double size_rad = 0.3) {
  return style::bind_model(toy_model(seed, size_rad), toy_skeleton(), "toy").value();
}

style::FilterOptions with_alpha(double alpha, style::FilterOptions options = {}) {
  options.alpha = alpha;
  return options;
}

// A filter in its settled state, the pelvis at its mean.
class Settled {
 public:
  Settled(const style::BoundModel* model, const Frame& frame, double alpha = 1.0,
          const style::FilterOptions& options = {})
      : filter(model, with_alpha(alpha, options)) {
    motion::LiveHeading heading;
    if (model != nullptr) heading.update(model->space.heading_rad(frame), 0.0);
    filter.settle(heading);
  }
  style::StyleFilter filter;
};

Frame run(Settled& settled, const Frame& in) { return run(settled.filter, in); }

// q of `frame` without its heading; change() is the difference of q of two frames.
Eigen::VectorXd pose_vector(const motion::PoseSpace& space, const Frame& frame,
                            double heading_rad) {
  std::vector<float> q(static_cast<std::size_t>(space.dims()));
  std::vector<std::uint8_t> available(q.size());
  space.to_vector(frame, heading_rad, q, available);
  return Eigen::Map<Eigen::VectorXf>(q.data(), space.dims()).cast<double>();
}
Eigen::VectorXd change(const motion::PoseSpace& space, const Frame& in, const Frame& out) {
  const double heading_rad = space.heading_rad(in);
  return pose_vector(space, out, heading_rad) - pose_vector(space, in, heading_rad);
}

double largest_delta_rad(const Frame& in, const Frame& out) {
  double largest = 0.0;
  for (int j = 0; j < kJoints; ++j) {
    largest =
        std::max(largest, angle_between_rad(Eigen::Quaterniond::Identity(), delta_of(in, out, j)));
  }
  return largest;
}

bool same_pose(const Frame& a, const Frame& b) {
  return std::memcmp(a.rotation_xyzw.data(), b.rotation_xyzw.data(), sizeof(Quatf) * kJoints) ==
             0 &&
         std::memcmp(a.angle_rad.data(), b.angle_rad.data(), sizeof(float) * a.angle_count) == 0;
}

}  // namespace

TEST_CASE("the filter adds alpha times the model delta", "[style]") {
  const auto model = toy_model(1);
  const auto ready = bound(1);
  const clip::Clip walk = toy_walk(50);
  const Frame in = walk.frame(33);
  Settled filter(ready.get(), in, 0.7);
  const Frame out = run(filter, in);

  const Eigen::VectorXd q = pose_vector(ready->space, in, ready->space.heading_rad(in));
  const Eigen::RowVectorXd f = gp::posterior(model.process, q.transpose()).mean;
  const Eigen::VectorXd added = change(ready->space, in, out);
  CHECK((added.transpose() - 0.7 * f).cwiseAbs().maxCoeff() < 1.7e-5);
  CHECK(out.header.sequence == in.header.sequence);
  CHECK(out.header.device_ns == in.header.device_ns);
  CHECK(out.root_position_m == in.root_position_m);
}

TEST_CASE("alpha 0, no model, or another skeleton leave every bit unchanged", "[style]") {
  const auto ready = bound(1);
  Frame in = toy_walk(50).frame(10);
  Settled silent(ready.get(), in, 0.0);
  CHECK(same_pose(run(silent, in), in));
  Settled empty(nullptr, in);
  CHECK(same_pose(run(empty, in), in));
  Settled other(ready.get(), in);
  in.skeleton ^= 1;
  CHECK(same_pose(run(other, in), in));
}

TEST_CASE("a stale frame keeps its quality", "[style]") {
  const auto ready = bound(1);
  Frame in = toy_walk(50).frame(10);
  Settled filter(ready.get(), in);
  in.quality = Quality::kStale;
  const Frame out = run(filter, in);
  CHECK(out.quality == Quality::kStale);
  CHECK(largest_delta_rad(in, out) > 0.01);
}

TEST_CASE("the first model of a stream that runs fades in, too", "[style]") {
  const auto ready = bound(1);
  const clip::Clip walk = toy_walk(110, 50.0);
  style::StyleFilter filter(nullptr, {});
  for (int i = 0; i < 100; ++i) CHECK(same_pose(run(filter, walk.frame(i)), walk.frame(i)));
  static_cast<void>(filter.set_model(ready.get()));
  for (int i = 100; i < 110; ++i) {
    run(filter, walk.frame(i));
    CHECK(filter.alpha() == Approx(0.04 * (i - 99)).margin(1e-6));
  }
}

TEST_CASE("a live start ramps alpha from 0 by the slew", "[style]") {
  const auto ready = bound(1);
  const clip::Clip walk = toy_walk(100, 50.0);
  style::StyleFilter filter(ready.get(), {});
  for (int i = 0; i < 100; ++i) {
    const Frame in = walk.frame(i);
    const Frame out = run(filter, in);
    CHECK(filter.alpha() == Approx(std::min(1.0, 0.04 * i)).margin(1e-6));
    if (i == 0) CHECK(same_pose(in, out));
  }
}

TEST_CASE("the clamp holds |a f| within |a| times the limit", "[style]") {
  style::StyleModel model = toy_model(1);
  model.limit_rad.setConstant(0.05);
  const auto ready = style::bind_model(model, toy_skeleton(), "toy").value();
  const Frame in = toy_walk(50).frame(12);
  for (const double alpha : {1.0, -2.0}) {
    Settled filter(ready.get(), in, alpha);
    const Frame out = run(filter, in);
    const double largest = change(ready->space, in, out).cwiseAbs().maxCoeff();
    CHECK(largest == Approx(0.05 * std::abs(alpha)).epsilon(1e-4));
  }
}

TEST_CASE("the walker's heading does not change the style", "[style]") {
  const auto ready = bound(2);
  style::StyleFilter straight(ready.get(), {});
  style::StyleFilter turned(ready.get(), {});
  const clip::Clip walk = toy_walk(200);
  const clip::Clip away = toy_walk(200, 60.0, 2.5);
  for (int i = 0; i < 200; ++i) {
    const Frame a = walk.frame(i);
    const Frame b = away.frame(i);
    const Frame a_out = run(straight, a);
    const Frame b_out = run(turned, b);
    for (int j = 0; j < kJoints; ++j) {
      CHECK(angle_between_rad(delta_of(a, a_out, j), delta_of(b, b_out, j)) < 2e-3);
    }
  }
}

TEST_CASE("broken joints come out as not measured and harm no other", "[style]") {
  const auto ready = bound(3);
  const Frame whole = toy_walk(50).frame(10);
  for (const float broken : {std::nanf(""), std::numeric_limits<float>::infinity(), 0.0F}) {
    Frame in = whole;
    in.rotation_xyzw[2] = {broken, broken, broken, broken};
    Settled filter(ready.get(), in);
    const Frame out = run(filter, in);
    CHECK_FALSE(out.valid[2]);
    CHECK(out.rotation_xyzw[2] == kIdentity);
    for (std::size_t j = 0; j < kJoints; ++j) {
      for (const float c : out.rotation_xyzw[j]) CHECK(std::isfinite(c));
    }
    CHECK(out.valid[1]);
    CHECK(out.rotation_xyzw[1] != in.rotation_xyzw[1]);
  }
  Frame none = whole;
  none.valid.reset();
  Settled filter(ready.get(), none);
  CHECK(same_pose(run(filter, none), none));
}

TEST_CASE("the angles of a styled joint make its rotation", "[style]") {
  const auto ready = bound(4);
  const Skeleton skeleton = toy_skeleton();
  const Frame in = toy_walk(50).frame(17);
  Settled filter(ready.get(), in, 1.5);
  const Frame out = run(filter, in);
  REQUIRE(out.angle_count == 15);
  std::vector<double> channels(18, 0.0);
  for (std::size_t c = 0; c < 15; ++c) channels[3 + c] = out.angle_rad[c];
  for (int j = 0; j < kJoints; ++j) {
    const auto rotation = to_eigen_double(out.rotation_xyzw[static_cast<std::size_t>(j)]);
    CHECK(angle_between_rad(local_rotation(skeleton, j, channels), rotation) < 1e-5);
  }
}

TEST_CASE("time that stands still, runs back or leaps does no harm", "[style]") {
  const auto ready = bound(1);
  style::StyleFilter filter(ready.get(), {});
  Frame in = toy_walk(50).frame(10);
  const std::int64_t last = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t time :
       {std::int64_t{0}, std::int64_t{0}, std::int64_t{-5}, kNoTime_ns, last, -last, last}) {
    const float before = filter.alpha();
    in.header.device_ns = time;
    const Frame out = run(filter, in);
    CHECK(filter.alpha() - before <= 0.2F + 1e-6F);
    CHECK(std::isfinite(out.rotation_xyzw[1][0]));
  }
}

TEST_CASE("an alpha out of range is clamped, NaN is ignored", "[style]") {
  const auto ready = bound(1);
  const Frame in = toy_walk(50).frame(10);
  Settled filter(ready.get(), in, 1.0);
  filter.filter.set_alpha(std::nanf(""));
  filter.filter.settle({});
  CHECK(filter.filter.alpha() == 1.0F);
  filter.filter.set_alpha(1e9F);
  filter.filter.settle({});
  CHECK(filter.filter.alpha() == 2.0F);
}

// angle(D(t-1), D(t)) <= |c| slew dt + the change of the model delta (style_filter.hpp). With the
// same frame repeated, the model delta changes only by alpha's slew.
TEST_CASE("a thousand swaps and alpha changes never step above the slew", "[style]") {
  constexpr double kSlew = 2.0;
  constexpr double kRate = 120.0;
  constexpr double kSize = 0.4;
  std::vector<std::unique_ptr<const style::BoundModel>> models;
  for (unsigned seed = 0; seed < 8; ++seed) models.push_back(bound(seed, kSize));
  // No model delta turns a joint by more than its three dimensions' limits, times alpha 2.
  const double answer = std::sqrt(3.0) * 1.5 * kSize;
  const double c = 2 * answer + 2 * answer;  // both ends of a blend
  const double bound_rad = (c + answer) * kSlew / kRate + 1e-5;
  style::StyleFilter filter(models[0].get(), {});
  std::mt19937 random(7);
  Frame in = toy_walk(50).frame(10);
  Frame before = in;
  double largest = 0.0;
  int swaps = 0;
  for (int i = 0; swaps < 1000; ++i) {
    if (random() % 8 == 0) {
      static_cast<void>(filter.set_model(models[random() % models.size()].get()));
      ++swaps;
    }
    if (random() % 8 == 0) filter.set_alpha(static_cast<float>(random() % 401) / 100.0F - 2.0F);
    in.header.device_ns = nanoseconds(i / kRate);
    const Frame out = run(filter, in);
    for (int j = 0; j < kJoints; ++j) {
      const double step = angle_between_rad(delta_of(in, before, j), delta_of(in, out, j));
      largest = std::max(largest, step);
    }
    before = out;
  }
  INFO("largest step " << largest << " rad, bound " << bound_rad);
  CHECK(largest <= bound_rad);
  CHECK(largest > 0.0);
}

TEST_CASE("the filter does not allocate", "[style]") {
  style::FilterOptions options;
  options.auto_alpha = true;
  const auto a = bound(gated_toy_model(1));
  const auto b = bound(gated_toy_model(2));
  style::StyleFilter filter(a.get(), options);
  REQUIRE(filter.command(style::StyleFilter::kWarmUp, StageCommand::of(0.3)));
  const clip::Clip walk = toy_walk(60);
  test::LastFrame last;
  std::uint64_t taken = 0;
  for (int i = 0; i < walk.frames(); ++i) {
    Frame in = walk.frame(i);
    if (i % 7 == 0) in.rotation_xyzw[2][0] = std::nanf("");
    const std::uint64_t before = test::allocations();
    if (i % 20 == 10) static_cast<void>(filter.set_model(i % 40 == 10 ? b.get() : a.get()));
    filter.set_alpha(static_cast<float>(i % 3));
    filter.process({.frame = in}, last);
    taken += test::allocations() - before;
  }
  CHECK(taken == 0);
}

TEST_CASE("a swap ends in the new model's own model delta", "[style]") {
  const auto a = bound(1);
  const auto b = bound(5);
  const Frame still = toy_walk(50).frame(10);
  Settled swapped(a.get(), still);
  Settled fresh(b.get(), still);
  CHECK(same_pose(run(swapped, still), run(swapped, still)));
  CHECK(swapped.filter.set_model(b.get()) == a.get());
  Frame in = still;
  const Frame first = run(swapped, in);  // no time has passed, so the old model delta still applies
  Settled old(a.get(), still);
  CHECK(angle_between_rad(delta_of(in, first, 3), delta_of(in, run(old, in), 3)) < 1e-5);
  for (int i = 1; i <= 60; ++i) {
    in.header.device_ns += kNanosPerSecond / 60;
    const Frame out = run(swapped, in);
    if (i > 31) CHECK(same_pose(out, run(fresh, in)));
  }
}

TEST_CASE("a style that is taken away fades out, and then every bit is the input's", "[style]") {
  auto ready = bound(1);
  const auto body = std::make_shared<const Skeleton>(toy_skeleton());
  Frame in = toy_walk(50).frame(10);
  style::StyleFilter filter(ready.get(), {}, body);
  filter.settle({});
  const auto next = [&] {
    in.header.device_ns += kNanosPerSecond / 60;
    return run(filter, in);
  };
  Frame last = in;
  for (int i = 0; i < 60; ++i) last = next();
  const double all_rad = largest_delta_rad(in, last);
  REQUIRE(all_rad > 0.1);
  REQUIRE(filter.use(nullptr));
  ready.reset();  // nobody reads it any more
  CHECK(filter.model() == nullptr);
  for (int i = 1; i <= 29; ++i) {
    const Frame out = next();
    CHECK(largest_delta_rad(last, out) < 1.1 * all_rad / 30.0);  // alpha's slew: half a second
    last = out;
  }
  CHECK(largest_delta_rad(in, last) < 0.1 * all_rad);
  for (int i = 0; i < 3; ++i) last = next();
  CHECK(same_pose(last, in));
  const auto other = bound(2);
  REQUIRE(filter.use(other.get()));
  CHECK(largest_delta_rad(in, next()) < 0.1);  // fades in as a first one
}

TEST_CASE("a source that jumps causes no jump of the style", "[style]") {
  const auto ready = bound(1);
  const clip::Clip walk = toy_walk(300);
  const clip::Clip away = toy_walk(300, 60.0, 2.5);
  style::StyleFilter filter(ready.get(), {});
  Frame before = walk.frame(0);
  Frame before_out = before;
  double walking = 0.0;
  double moved = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Frame in = i < 150 ? walk.frame(i) : away.frame(i);
    const Frame out = run(filter, in);
    double& largest = i < 150 ? walking : moved;
    for (int j = 0; j < kJoints; ++j) {
      largest = std::max(largest,
                         angle_between_rad(delta_of(before, before_out, j), delta_of(in, out, j)));
    }
    before = in;
    before_out = out;
  }
  CHECK(moved < 1.1 * walking);
}

TEST_CASE("a model that does not fit the body is refused with the missing joints", "[style]") {
  style::StyleModel model = toy_model(1);
  model.space.joints[2] = "Tail";
  const auto refused = style::bind_model(model, toy_skeleton(), "fox.style");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().text().find("Tail") != std::string::npos);
  CHECK(refused.error().text().find("fox.style") != std::string::npos);
  model = toy_model(1);
  model.limit_rad.conservativeResize(3);
  CHECK_FALSE(style::bind_model(model, toy_skeleton(), "fox.style"));
  model = toy_model(1);
  model.process.weights = model.process.weights.leftCols(14).eval();
  CHECK_FALSE(style::bind_model(model, toy_skeleton(), "fox.style"));
}
