// What trees may ask: the classes of a hand's fingers and of a body's groups, and labels by name.
#include "models/gesture/vocabulary.hpp"

#include <catch2/catch.hpp>

#include "models/gesture/body_recording.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/train.hpp"
#include "tests/support/arm_raiser.hpp"

namespace posed::gesture {
namespace {

std::string body_refusal(const std::vector<JointGroup>& groups) {
  const auto vocabulary = body_vocabulary(groups);
  return vocabulary ? "" : vocabulary.error().message;
}

bool mentions(const std::string& message, const std::string& what) {
  UNSCOPED_INFO(message);
  return message.find(what) != std::string::npos;
}

// A recording of one group's first channel that holds 0, then 1, then 0, and so on, where the label
// says which; with a little motion everywhere so that no channel is constant.
Recording switching(const std::vector<std::string>& labels, const std::vector<double>& values,
                    int channels) {
  constexpr int kFrames = 20;
  Recording recording{.file = "switching", .rate_hz = 30.0, .angles_rad = {}, .segments = {}};
  const auto count = static_cast<int>(labels.size());
  recording.angles_rad = FeatureMatrix::Zero(kFrames * count, channels);
  PortableRandom random(3);
  for (int s = 0; s < count; ++s) {
    recording.segments.push_back({s * kFrames, (s + 1) * kFrames, labels[s]});
    for (int t = s * kFrames; t < (s + 1) * kFrames; ++t) {
      for (int c = 0; c < channels; ++c) recording.angles_rad(t, c) = 0.01 * random.normal();
      recording.angles_rad(t, 0) += values[s];
    }
  }
  return recording;
}

}  // namespace

TEST_CASE("A hand's trees ask for the three classes of a finger", "[vocabulary]") {
  const Vocabulary hand = built_in_vocabulary();
  CHECK(hand.is_hand());
  CHECK(hand.channels() == kHandChannels);
  REQUIRE(hand.groups.size() == kFingers);
  CHECK(hand.groups[2].name == "middle");
  CHECK(hand.groups[2].first == 2 * kFingerChannels);
  const int one = hand.label_index("1");  // index open, the others closed
  for (int group = 0; group < kFingers; ++group) {
    CHECK(hand.statements(group) == kClasses);
    CHECK(hand.holds(group, 2, one) == (group == 1));
  }
  CHECK(hand.statements(Vocabulary::kDurations) == kClasses);
  CHECK(hand.holds(Vocabulary::kDurations, 0, one));
}

TEST_CASE("A body's durations ask for the classes of each group, and labels by name",
          "[vocabulary]") {
  Vocabulary body =
      body_vocabulary({{"arm", {"leftUpperArm"}}, {"rest", {"hips", "head"}}}).value();
  CHECK_FALSE(body.is_hand());
  CHECK(body.channels() == 9);
  body.groups[0].classes = 4;
  body.groups[1].classes = 2;
  body.labels = {{"a", {3, 0}}, {"b", {1, 1}}};
  body.named = {1};
  CHECK(body.statements(0) == 5);
  CHECK(body.statements(Vocabulary::kDurations) == 7);
  CHECK(body.holds(0, 3, 0));
  CHECK_FALSE(body.holds(0, 4, 0));
  CHECK(body.holds(0, 4, 1));
  CHECK(body.holds(Vocabulary::kDurations, 3, 0));
  CHECK(body.holds(Vocabulary::kDurations, 4, 0));
  CHECK(body.holds(Vocabulary::kDurations, 5, 1));
  CHECK(body.holds(Vocabulary::kDurations, 6, 1));
  CHECK_FALSE(body.holds(Vocabulary::kDurations, 6, 0));
}

TEST_CASE("Groups that do not divide a body are refused", "[vocabulary]") {
  CHECK(body_refusal(body_groups()).empty());
  CHECK(mentions(body_refusal({{"arm", {}}, {"rest", {"hips"}}}), "group 'arm' has no joints"));
  CHECK(mentions(body_refusal({{"arm", {"elbow"}}, {"rest", {"hips"}}}),
                 "'elbow', which is no bone of the humanoid"));
  CHECK(mentions(body_refusal({{"arm", {"leftHand"}}, {"rest", {"hips", "leftHand"}}}),
                 "groups overlap: joint 'leftHand' is in 'arm' and again in 'rest'"));
  CHECK(mentions(body_refusal({{"arm", {"leftHand", "leftHand"}}}), "groups overlap"));
  CHECK(mentions(body_refusal({{"arm", {"leftHand"}}}), "no group has the joint hips"));
  CHECK(mentions(body_refusal({{"two words", {"hips"}}}), "is no name of a group"));
  CHECK(mentions(body_refusal({}), "1 to 16 groups"));
}

TEST_CASE("Labels of equal classes stay apart if questions may name one", "[vocabulary]") {
  Vocabulary body = body_vocabulary({{"all", {"hips"}}}).value();
  body.labels = {{"low", {0}}, {"high", {0}}, {"rest", {0}}};
  std::vector<std::string> names;
  std::vector<double> values;
  for (int i = 0; i < 8; ++i) {
    for (const auto& [name, value] : {std::pair("rest", 0.0), std::pair("low", 0.5),
                                      std::pair("rest", 0.0), std::pair("high", 1.0)}) {
      names.emplace_back(name);
      values.push_back(value);
    }
  }
  const auto held = [&](const std::vector<int>& named, const char* label) {
    TrainOptions options;
    options.vocabulary = body;
    options.vocabulary.named = named;
    const auto model = train_gesture({switching(names, values, 3)}, options);
    REQUIRE(model.has_value());
    const int rest = model->label_index("rest");
    return leaf(*model, 2, 0, {rest, model->label_index(label), rest}).mean[0][0];
  };
  CHECK(held({}, "high") == Approx(held({}, "low")));
  CHECK(held({1, 2}, "high") == Approx(1.0).margin(0.02));
  CHECK(held({1, 2}, "low") == Approx(0.5).margin(0.02));
}

TEST_CASE("Classes of a body's labels are proposed where its poses are alike", "[vocabulary]") {
  Vocabulary body = body_vocabulary({{"arm", {"leftUpperArm"}}, {"rest", {"hips"}}}).value();
  const auto pose = [](const char* name, double arm_deg) {
    return LabelPose{name, {0.0, 0.0, arm_deg * kDegree, 0.0, 0.0, 0.0}};
  };
  propose_body_labels({pose("a", -70), pose("b", -66), pose("c", 0), pose("d", 60), pose("e", 68)},
                      body);
  CHECK(body.groups[0].classes == 3);
  CHECK(body.groups[1].classes == 1);
  const auto class_of = [&](int label) { return body.labels[label].group_class[0]; };
  CHECK(class_of(0) == class_of(1));
  CHECK(class_of(3) == class_of(4));
  CHECK(class_of(2) == 0);  // nearest to all others
  CHECK(class_of(0) != class_of(3));
}

TEST_CASE("A body's model file with a wrong body is refused", "[gesture_file]") {
  TrainOptions options;
  options.vocabulary = body_vocabulary({{"all", {"hips"}}}).value();
  options.vocabulary.labels = {{"a", {0}}, {"b", {0}}};
  const auto good =
      train_gesture({switching({"a", "b", "a", "b"}, {0.0, 1.0, 0.0, 1.0}, 3)}, options);
  REQUIRE(good.has_value());
  const auto verdict = [&](const auto& spoil) {
    GestureModel model = *good;
    spoil(model);
    const std::string bytes = serialize_model(model);
    const auto parsed = parse_model(std::as_bytes(std::span(bytes)), "b.gesture");
    return parsed ? std::string("sound") : parsed.error().message;
  };
  CHECK(verdict([](auto&) {}) == "sound");
  CHECK(mentions(verdict([](auto& m) { m.body->joints[0] = "elbow"; }), "no bone"));
  CHECK(mentions(verdict([](auto& m) { m.body->mean[0].w() = 2.0; }), "a mean rotation"));
  CHECK(mentions(verdict([](auto& m) { m.groups[0].channels = 6; }), "the groups"));
  CHECK(mentions(verdict([](auto& m) { m.groups[0].classes = 27; }), "classes"));
  CHECK(mentions(verdict([](auto& m) { m.named = {2}; }), "a label that questions name"));
  CHECK(mentions(verdict([](auto& m) { m.body.reset(); }), "a label's classes"));
}

}  // namespace posed::gesture
