// A stage that posed does not have: the engine runs it from its StageType alone.
#include <catch2/catch.hpp>

#include <array>
#include <memory>
#include <vector>

#include "daemon/pipeline/stream_settings.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::pipeline {
namespace {

// Lifts the body, and repeats each frame `copies` times.
class LiftStage final : public Stage {
 public:
  explicit LiftStage(const Parameters& parameters)
      : height_m_(parameter<double>(parameters, "height_m")),
        copies_(parameter<std::int64_t>(parameters, "copies")) {}

  void process(const StageFrame& in, StageOut& out) noexcept override {
    Frame frame = in.frame;
    frame.root_position_m[1] += static_cast<float>(height_m_);
    for (std::int64_t i = 0; i < copies_; ++i) out.frame({.frame = frame, .input = in.input});
  }
  void set(std::size_t /*parameter*/, double value) noexcept override { height_m_ = value; }
  [[nodiscard]] ParameterState state(std::size_t /*parameter*/) const noexcept override {
    return {height_m_, height_m_};
  }

 private:
  double height_m_;
  std::int64_t copies_;
};

const StageType& lift_type() {
  static const StageType type{
      .name = "lift",
      .summary = "lifts the body",
      .parameters = {{.name = "height_m",
                      .default_value = 0.5,
                      .help = "how far",
                      .min = 0.0,
                      .max = 2.0,
                      .live = true},
                     {.name = "copies", .default_value = std::int64_t{1}, .help = "of each frame"}},
      .make = [](const StageContext& context, const StageModel*) -> Result<std::unique_ptr<Stage>> {
        return std::make_unique<LiftStage>(context.parameters);
      }};
  return type;
}

class Heights final : public EngineOut {
 public:
  void item(const Item& item) noexcept override {
    if (item.kind == Item::Kind::kFrame) heights_m.push_back(item.frame.root_position_m[1]);
  }
  void decision(const Decision&) noexcept override {}
  std::vector<float> heights_m;
};

TEST_CASE("a stage of one's own runs from its table, and its live parameter changes") {
  const auto skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  StreamSettings settings;
  settings.stages = {stage_settings(lift_type(), {{"copies", std::int64_t{2}}})};
  const std::array<const StageModel*, 1> models{nullptr};
  auto options = engine_options(0, settings, skeleton, models);
  REQUIRE(options);
  StreamEngine engine(std::move(*options));
  Heights out;
  Frame frame;
  frame.header.sequence = 1;
  engine.on_frame(frame, out);
  Command command;
  command.change = {.index = 0, .type = &lift_type(), .value = 1.5};
  CHECK_FALSE(engine.apply(command, out).refused);
  CHECK(engine.live_parameters() == 1);
  CHECK(engine.live_parameter(0).now == 1.5);
  frame.header.sequence = 2;
  engine.on_frame(frame, out);
  CHECK(out.heights_m == std::vector<float>{0.5F, 0.5F, 1.5F, 1.5F});
}

TEST_CASE("a change to a stage that the stream does not have is refused") {
  StreamEngine engine({});
  Heights out;
  Command command;
  command.change.type = &lift_type();
  CHECK(engine.apply(command, out).refused);
}

TEST_CASE("stages need poses") {
  StreamSettings settings;
  settings.stages = {stage_settings(lift_type())};
  const std::array<const StageModel*, 1> models{nullptr};
  const auto options = engine_options(0, settings, nullptr, models);
  REQUIRE_FALSE(options);
  CHECK(options.error().message.contains("stage lift has nothing to work on"));
}

}  // namespace
}  // namespace posed::pipeline
