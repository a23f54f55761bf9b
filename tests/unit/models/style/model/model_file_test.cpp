// The style model's file: written and read back, and a clear error for every file that is not one.
#include <catch2/catch.hpp>

#include <limits>

#include "models/style/model/style_model.hpp"
#include "proto/model/model_file.hpp"

using namespace posed;
using namespace posed::style;

namespace {

StyleModel small_model() {
  StyleModel model;
  model.space.joints = {"Hips", "Spine"};
  model.space.mean = {Eigen::Quaterniond::Identity(), Eigen::Quaterniond(0.8, 0.6, 0.0, 0.0)};
  model.process.inputs = Eigen::MatrixXd::Random(5, 6);
  model.process.weights = Eigen::MatrixXd::Random(5, 6);
  model.process.offset = Eigen::VectorXd::Random(6);
  model.limit_rad = Eigen::VectorXd::Constant(6, 0.2);
  model.from = "masculine";
  model.to = "feminine";
  model.report_json = "{}";
  return model;
}

Result<StyleModel> parse(const std::string& bytes) {
  return parse_model(std::as_bytes(std::span(bytes)), "test.style");
}

void refused(const StyleModel& model, const std::string& why) {
  const auto parsed = parse(serialize_model(model));
  REQUIRE_FALSE(parsed.has_value());
  CHECK(parsed.error().message.find(why) != std::string::npos);
  CHECK(parsed.error().file == "test.style");
}

}  // namespace

TEST_CASE("A model reads back as it was written", "[model_file]") {
  const StyleModel model = small_model();
  const auto parsed = parse(serialize_model(model));
  REQUIRE(parsed.has_value());
  CHECK(parsed->process.inputs == model.process.inputs);
  CHECK(parsed->process.weights == model.process.weights);
  CHECK(parsed->space.joints == model.space.joints);
  CHECK(parsed->space.mean[1].coeffs() == model.space.mean[1].coeffs());
  CHECK(parsed->to == "feminine");
  CHECK(serialize_model(*parsed) == serialize_model(model));
}

TEST_CASE("A model of several styles reads back as it was written", "[model_file]") {
  StyleModel model = small_model();
  const StyleModel other = small_model();
  model.more.push_back({"elderly", {other.process.weights, other.process.offset}, other.limit_rad});
  const auto parsed = parse(serialize_model(model));
  REQUIRE(parsed.has_value());
  CHECK(parsed->names() == std::vector<std::string>{"feminine", "elderly"});
  CHECK(parsed->more[0].function.weights == other.process.weights);
  CHECK(parsed->more[0].function.offset == other.process.offset);
  CHECK(serialize_model(*parsed) == serialize_model(model));
  model.more[0].name = "feminine";
  refused(model, "styles' names");
  model.more[0].name = "elderly";
  model.more[0].function.weights.conservativeResize(4, 6);
  refused(model, "number of a style's weights");
  model.more[0] = {"elderly", {other.process.weights, other.process.offset}, -other.limit_rad};
  refused(model, "the limits");
  model.more[0] = {"elderly", {other.process.weights, other.process.offset.head(3)}, {}};
  refused(model, "a style's prior mean");
}

TEST_CASE("A model with the fields of older versions reads back without them", "[model_file]") {
  const std::string written = serialize_model(small_model());
  auto file = model_file::open(std::as_bytes(std::span(written)), "test.style").value();
  v1::StyleModel& style = *file.mutable_style();
  const std::string six_numbers(6 * sizeof(double), '\0');
  for (const int reserved : {4, 5}) {
    style.GetReflection()->MutableUnknownFields(&style)->AddLengthDelimited(reserved, six_numbers);
  }
  const std::string older = model_file::wrap(std::move(file));
  REQUIRE(older.size() > written.size() + 2 * six_numbers.size());
  const auto parsed = parse(older);
  REQUIRE(parsed.has_value());
  CHECK(serialize_model(*parsed) == written);
}

TEST_CASE("A model is saved whole or not at all", "[model_file]") {
  const auto folder = std::filesystem::temp_directory_path() / "posed_model_file_test";
  std::filesystem::create_directories(folder);
  const auto path = folder / "a.style";
  REQUIRE(save_model(small_model(), path).has_value());
  CHECK(load_model(path).has_value());
  CHECK_FALSE(std::filesystem::exists(path.string() + ".part"));
  CHECK_FALSE(save_model(small_model(), folder / "no" / "a.style").has_value());
  CHECK_FALSE(load_model(folder).has_value());
  CHECK_FALSE(load_model(folder / "none.style").has_value());
  std::filesystem::remove_all(folder);
}

TEST_CASE("Truncated, corrupted and foreign files are refused", "[model_file]") {
  const std::string good = serialize_model(small_model());
  for (std::size_t size = 0; size < good.size(); ++size) {
    CHECK_FALSE(parse(good.substr(0, size)).has_value());
  }
  for (std::size_t at = 0; at < good.size(); at += 3) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    CHECK_FALSE(parse(bad).has_value());
  }
  CHECK_FALSE(parse(good + "x").has_value());
  CHECK(parse("HIERARCHY\nROOT Hips\n{\n}\n").error().message.find("not a posed model") !=
        std::string::npos);
}

TEST_CASE("A model whose parts do not fit is refused by name", "[model_file]") {
  auto model = small_model();
  model.process.weights = Eigen::MatrixXd::Random(4, 6);
  refused(model, "number of weights");
  model = small_model();
  model.process.inputs = Eigen::MatrixXd::Random(5, 5);
  refused(model, "inputs' shape");
  model = small_model();
  model.process.weights(2, 3) = std::numeric_limits<double>::quiet_NaN();
  refused(model, "weights' shape or values");
  model = small_model();
  model.space.mean[0].coeffs() *= 1.5;
  refused(model, "unit quaternion");
  model = small_model();
  model.space.mean.pop_back();
  refused(model, "mean rotations");
  model = small_model();
  model.space.root = 7;
  refused(model, "root joint");
  model = small_model();
  model.space.joints[1] = "Hips";
  refused(model, "joints' names");
  model = small_model();
  model.limit_rad[3] = -1.0;
  refused(model, "the limits");
  model = small_model();
  model.process.mu = -1.0;
  refused(model, "mu");
  model = small_model();
  model.rate_hz = std::numeric_limits<double>::infinity();
  refused(model, "frame rate");
  model = small_model();
  model.gate = {Eigen::VectorXd::Zero(small_model().limit_rad.size()), 0.0, 1.0};
  refused(model, "swing");
  model.gate = {model.gate.neutral, 0.5, 0.0};
  refused(model, "fastest stride");
  model.gate = {model.gate.neutral, 0.5, 1.0, 1.5};
  refused(model, "gait");
  model = small_model();
  model.space.joints.assign(97, "");
  refused(model, "number of joints");
}

TEST_CASE("Numbers that no training gives are refused", "[model_file]") {
  const auto with = [](auto spoil) {
    StyleModel model = small_model();
    spoil(model);
    return model;
  };
  refused(with([](auto& m) { m.process.inputs(0, 0) = 1e4; }), "inputs' shape or values");
  refused(with([](auto& m) { m.process.weights(0, 0) = -1e20; }), "weights' shape or values");
  refused(with([](auto& m) { m.process.offset[0] = 1e4; }), "the prior mean");
  refused(with([](auto& m) { m.process.lambda = 50.0; }), "lambda");
  refused(with([](auto& m) { m.process.b = 1e20; }), "b");
  refused(with([](auto& m) { m.process.noise = 1e20; }), "the noise");
  refused(with([](auto& m) { m.limit_rad[0] = 1e4; }), "the limits");
  refused(with([](auto& m) { m.gate = {Eigen::VectorXd::Constant(6, 1e4), 0.5, 1.0}; }),
          "the neutral pose");
  for (const std::vector<double>& places : {std::vector{0.0, 2.0}, std::vector{0.0}}) {
    refused(with([&](auto& m) {
              m.gate = {Eigen::VectorXd::Zero(6), 0.5, 1.0};
              m.gate.places = places;
            }),
            "the trunk's places");
  }
  refused(with([](auto& m) { m.axis = {Eigen::VectorXd::Constant(6, 1e20), 0.0}; }),
          "the style's axis");
  refused(with([](auto& m) { m.axis = {Eigen::VectorXd::Constant(6, 1.0), 1e20}; }),
          "the style's offset");
}
