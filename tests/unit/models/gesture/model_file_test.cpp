// The gesture model's file: written and read back, and a clear error for every file that is not
// one.
#include <catch2/catch.hpp>

#include <limits>

#include "models/gesture/model_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

using namespace posed;
using namespace posed::gesture;

namespace {

Result<GestureModel> parse(const std::string& bytes) {
  return parse_model(std::as_bytes(std::span(bytes)), "test.gesture");
}

// The result of parsing the toy model after `spoil` has changed it.
template <typename Spoil>
std::string verdict(Spoil spoil) {
  GestureModel model = test::toy_gesture_model();
  spoil(model);
  const auto parsed = parse(serialize_model(model));
  return parsed ? "sound" : parsed.error().message;
}

bool says(const std::string& message, const std::string& what) {
  UNSCOPED_INFO(message);
  return message.find("the model is not valid: " + what) == 0;
}

}  // namespace

TEST_CASE("A gesture model reads back as it was written", "[gesture_file]") {
  const GestureModel model = test::toy_gesture_model();
  const auto parsed = parse(serialize_model(model));
  REQUIRE(parsed.has_value());
  CHECK(serialize_model(*parsed) == serialize_model(model));
  const Context context{0, 3, 1};
  for (int f = 0; f < kFingers; ++f) {
    CHECK(leaf(*parsed, 2, f, context).mean == leaf(model, 2, f, context).mean);
    CHECK(leaf(*parsed, 2, f, context).variance == leaf(model, 2, f, context).variance);
  }
  CHECK(parsed->label_index("4") == 5);
  CHECK_FALSE(parsed->labels[5].trained);
  CHECK(duration(*parsed, context).mean == duration(model, context).mean);
  CHECK(parsed->high == model.high);
  CHECK_FALSE(parsed->tells_none);
  GestureModel with_none = model;
  with_none.tells_none = true;
  CHECK(parse(serialize_model(with_none))->tells_none);
}

TEST_CASE("Held and shown poses read back, and wrong ones are refused", "[gesture_file]") {
  GestureModel model = test::toy_gesture_model();
  model.labels[3].shown.assign(kHandChannels, 0.25);
  model.held = HeldPoses{.mean = std::vector(3, std::vector<double>(kHandChannels, 0.5)),
                         .whitening = std::vector<double>(kHandChannels * (kHandChannels + 1) / 2),
                         .limit = {1.0, 2.0, 3.0},
                         .people = 20};
  const auto parsed = parse(serialize_model(model));
  REQUIRE(parsed.has_value());
  CHECK(serialize_model(*parsed) == serialize_model(model));
  CHECK(parsed->labels[3].shown == model.labels[3].shown);
  CHECK(parsed->held->limit == model.held->limit);
  GestureModel wrong = model;
  wrong.held->whitening.pop_back();
  CHECK_FALSE(parse(serialize_model(wrong)).has_value());
  wrong = model;
  wrong.labels[3].shown.pop_back();
  CHECK_FALSE(parse(serialize_model(wrong)).has_value());
}

TEST_CASE("A gesture model is saved completely and loaded again", "[gesture_file]") {
  const test::TempFolder folder;
  REQUIRE(save_model(test::toy_gesture_model(), folder.path() / "a.gesture").has_value());
  CHECK(load_model(folder.path() / "a.gesture").has_value());
  CHECK_FALSE(load_model(folder.path()).has_value());
  CHECK_FALSE(load_model(folder.path() / "none.gesture").has_value());
}

TEST_CASE("Truncated and corrupted gesture models are refused", "[gesture_file]") {
  const std::string good = serialize_model(test::toy_gesture_model());
  for (std::size_t size = 0; size < good.size(); size += 97) {
    CHECK_FALSE(parse(good.substr(0, size)).has_value());
  }
  for (std::size_t at = 0; at < good.size(); at += 61) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    CHECK_FALSE(parse(bad).has_value());
  }
}

TEST_CASE("Nodes that do not form a tree are refused", "[gesture_file]") {
  CHECK(verdict([](GestureModel&) {}) == "sound");
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes[2].no = 0; }), "a child"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes[2].no = 5; }), "a child"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes[0].yes = 3; }), "a tree's node"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes[0].question = 9; }), "a question"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes[1].leaf = 2; }), "a leaf"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].nodes.clear(); }), "the number of nodes"));
  CHECK(says(verdict([](auto& m) { m.trees[1][2].leaves.pop_back(); }), "the number of a tree's"));
  CHECK(says(verdict([](auto& m) { m.durations.occupancy.pop_back(); }), "the number of a tree's"));
}

TEST_CASE("Numbers and labels that a lookup cannot use are refused", "[gesture_file]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(says(verdict([&](auto& m) { m.trees[4][0].leaves[1].mean[2][8] = nan; }), "a mean"));
  CHECK(says(verdict([](auto& m) { m.trees[4][0].leaves[1].variance[0][0] = 0; }), "a variance"));
  CHECK(says(verdict([](auto& m) { m.durations.leaves[0].variance[4] = -1; }), "a variance"));
  CHECK(says(verdict([&](auto& m) { m.rate_hz = nan; }), "the frame rate"));
  CHECK(says(verdict([](auto& m) { m.labels.clear(); }), "the number of labels"));
  CHECK(says(verdict([](auto& m) { m.labels[1].name = "g"; }), "a label's name, which stands"));
  CHECK(says(verdict([](auto& m) { m.labels[1].name = "two words"; }), "a label's name"));
  CHECK(says(verdict([](auto& m) { m.labels[1].group_class[3] = 3; }), "a label's class"));
  CHECK(says(verdict([](auto& m) { m.low[7] = 1; }), "the range of an angle"));
}

TEST_CASE("Numbers that no training gives are refused", "[gesture_file]") {
  CHECK(
      says(verdict([](auto& m) { m.durations.leaves[0].mean[4] = 3600.0 * m.rate_hz; }), "a mean"));
  CHECK(says(verdict([](auto& m) { m.durations.leaves[0].mean[0] = -5.0; }), "a mean"));
  CHECK(says(verdict([](auto& m) { m.durations.leaves[0].variance[0] = 1e20; }), "a variance"));
  CHECK(says(verdict([](auto& m) { m.trees[0][0].leaves[0].mean[0][0] = 1e4; }), "a mean"));
  CHECK(says(verdict([](auto& m) { m.trees[0][0].leaves[0].variance[0][0] = 1e8; }), "a variance"));
  CHECK(says(verdict([](auto& m) { m.durations.occupancy[0] = 1e20; }), "an occupancy"));
  CHECK(says(verdict([](auto& m) { m.high[7] = 900.0; }), "the range of an angle"));
  // The longest state that is one is well below.
  CHECK(verdict([](auto& m) { m.durations.leaves[0].mean[4] = 60.0 * m.rate_hz; }) == "sound");
}
