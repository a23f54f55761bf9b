// Paths that are not regular files, and TOML that would overflow the parser's stack, at every place
// where the daemon reads files: each gives one error sentence, and nothing blocks.
#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "daemon/config/config.hpp"
#include "daemon/devices/calibration.hpp"
#include "daemon/devices/open_source.hpp"
#include "drivers/options.hpp"
#include "models/generate/generate_stage.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/toml_bombs.hpp"

namespace posed {
namespace {

config::StreamConfig stream_of(const std::string& driver, const drivers::Options& options = {}) {
  config::StreamConfig config;
  config.name = "hand";
  config.driver = driver;
  config.options = drivers::complete_options(*drivers::find_driver(driver), options).value();
  return config;
}

std::string refusal(const config::StreamConfig& config) {
  devices::ModelFiles files;
  const auto opened = devices::open_source(config::source_of(config), files);
  REQUIRE_FALSE(opened);
  CHECK(opened.error().message.starts_with("stream 'hand': "));
  return opened.error().message;
}

drivers::Description a_glove() {
  return drivers::find_driver("lucidgloves")
      ->expect(stream_of("lucidgloves", {{"port", std::string("/dev/none")}}).options)
      .value();
}

TEST_CASE("a model or calibration that is not a regular file is refused at once", "[hostile]") {
  const test::TempFolder folder;
  const auto pipe = folder.path() / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  for (const auto& [path, sentence] :
       {std::pair<std::filesystem::path, std::string>{folder.path(), "this is a folder; name a "},
        {"/dev/zero", "this is a device or a pipe"},
        {pipe, "this is a device or a pipe"}}) {
    INFO(path);
    auto styled = stream_of("labels");
    styled.stages.push_back({.type = &style::style_type(), .model = path});
    CHECK_THAT(refusal(styled), Catch::Contains(sentence));
    auto generated = stream_of("labels");
    generated.stages.push_back({.type = &generate::generate_type(), .model = path});
    CHECK_THAT(refusal(generated), Catch::Contains(sentence));
    auto calibrated = stream_of("lucidgloves", {{"port", std::string("/dev/none")}});
    calibrated.calibration = path;
    CHECK_THAT(refusal(calibrated), Catch::Contains(sentence));
  }
}

TEST_CASE("the error for a missing calibration says how to make one", "[hostile]") {
  auto config = stream_of("lucidgloves", {{"port", std::string("/dev/none")}});
  config.calibration = "/nowhere/ann.toml";
  CHECK_THAT(refusal(config),
             Catch::Contains("there is no such calibration; make one with `posed "
                             "calibrate --driver lucidgloves --user NAME --out ann.toml`"));
}

TEST_CASE("a calibration that is nested too deep is refused from control, config and log",
          "[hostile]") {
  for (const std::string& bomb : test::toml_bombs()) {
    const auto refused = devices::compile_calibration(a_glove(), bomb, "ann.toml");
    REQUIRE_FALSE(refused);
    CHECK_THAT(refused.error().text(), Catch::Contains("ann.toml:1: nests deeper"));
    const test::TempFolder folder;
    auto config = stream_of("lucidgloves", {{"port", std::string("/dev/none")}});
    config.calibration = folder.write("ann.toml", bomb);
    CHECK_THAT(refusal(config), Catch::Contains("nests deeper"));
  }
}

TEST_CASE("a config that is nested too deep gives one error with its line", "[hostile]") {
  for (const std::string& bomb : test::toml_bombs()) {
    const auto reading =
        config::read_config("realtime = false\n" + bomb, "/nowhere/a.toml", drivers::registry());
    REQUIRE(reading.errors.size() == 1);
    CHECK_THAT(reading.errors[0].text(), Catch::StartsWith("/nowhere/a.toml:2: nests deeper"));
    CHECK(reading.errors[0].exit_code == ExitCode::kWrongUse);
  }
}

TEST_CASE("a config with too many tables gives one sentence, whatever their number", "[hostile]") {
  const auto config_of = [](int streams) {
    std::string text;
    for (int i = 0; i < streams; ++i) {
      text += "[[stream]]\nname = \"s" + std::to_string(i) + "\"\ndriver = \"labels\"\n";
    }
    return config::read_config(text, "a.toml", drivers::registry());
  };
  CHECK(config_of(64).errors.empty());
  const auto one_more = config_of(65);
  REQUIRE(one_more.errors.size() == 1);
  CHECK(one_more.errors[0].message ==
        "there are 65 [[stream]] tables, but max_streams is 64; it takes up to 256");
  std::string empty_tables;
  for (int i = 0; i < 50'000; ++i) empty_tables += "[[stream]]\n";
  const auto flood = config::read_config(empty_tables, "a.toml", drivers::registry());
  REQUIRE(flood.errors.size() == 1);
  CHECK_THAT(flood.errors[0].message, Catch::Contains("more than 16384 keys and values"));
}

TEST_CASE("clients, labels and errors are limited in number, too", "[hostile]") {
  std::string clients = "[security]\nserver_key = \"\"\n";
  for (int i = 0; i < 1025; ++i) clients += "[[security.client]]\nname = \"c\"\n";
  const auto many = config::read_config(clients, "a.toml", drivers::registry());
  CHECK(std::ranges::count_if(many.errors, [](const Error& error) {
          return error.message.contains("1025 [[security.client]] tables");
        }) == 1);

  std::string labels;
  for (int i = 0; i < 257; ++i) labels += "g ";
  const auto performed = config::read_config(
      "[[stream]]\nname = \"a\"\ndriver = \"labels\"\n[stream.generate]\nmodel = \"m\"\n"
      "labels = \"" +
          labels + "\"\n",
      "a.toml", drivers::registry());
  REQUIRE(performed.errors.size() == 1);
  CHECK_THAT(performed.errors[0].message, Catch::Contains("257 labels are too many at once"));

  std::string mistakes;
  for (int i = 0; i < 5000; ++i) mistakes += "x" + std::to_string(i) + " = 1\n";
  const auto wrong = config::read_config(mistakes, "a.toml", drivers::registry());
  CHECK(wrong.errors.size() == 101);
}

}  // namespace
}  // namespace posed
