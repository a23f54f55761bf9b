#include <catch2/catch.hpp>

#include "daemon/config/config.hpp"

namespace posed::config {
namespace {

Result<std::unique_ptr<drivers::SourceLayout>> no_layout(std::span<const std::byte>) {
  return fail("not used here");
}

// Two devices with several bodies, and one with one.
std::vector<drivers::Driver> mocap_drivers() {
  using drivers::OptionSpec;
  drivers::Driver mocap{.name = "mocap",
                        .summary = "people, as Motive sends them",
                        .options = {OptionSpec{"listen", std::string("here"), false, false, ""},
                                    OptionSpec{"rate_hz", 100.0, false, false, ""}},
                        .open = nullptr,
                        .make_decoder = nullptr,
                        .describe = nullptr,
                        .make_layout = no_layout};
  drivers::Driver calibrated = mocap;
  calibrated.name = "cameras";
  calibrated.options = {OptionSpec{"file", std::string(), true, true, "the cameras' places"}};
  drivers::Driver glove = mocap;
  glove.name = "glove";
  glove.options = {OptionSpec{"port", std::string(), false, false, ""}};
  glove.make_layout = nullptr;
  return {mocap, calibrated, glove};
}

Reading read_sources(const std::string& text) {
  static const auto drivers = mocap_drivers();
  return read_config(text, "stage/posed.toml", drivers);
}

constexpr const char* kOptitrack = R"([[source]]
name = "optitrack"
driver = "mocap"
)";
constexpr const char* kAnn = R"([[stream]]
name = "ann"
source = "optitrack"
body = "Ann"
)";

TEST_CASE("the mapping of joints belongs to a source and lies in the config's folder") {
  const Reading reading =
      read_sources(std::string(kOptitrack) + "streams = \"all\"\nskeleton = \"map.toml\"\n");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  CHECK(reading.config.sources.at(0).skeleton == "stage/map.toml");
  const Reading body = read_sources(std::string(kOptitrack) + kAnn + "skeleton = \"map.toml\"\n");
  REQUIRE(body.errors.size() == 1);
  CHECK(body.errors[0].text().contains("in its [[source]] table"));
}

// The only error for this text, with its line.
std::string source_complaint(const std::string& text) {
  const Reading reading = read_sources(text);
  INFO(text);
  for (const Error& error : reading.errors) UNSCOPED_INFO(error.text());
  REQUIRE(reading.errors.size() == 1);
  CHECK(reading.errors[0].exit_code == ExitCode::kWrongUse);
  const std::string sentence = reading.errors[0].text();
  const std::string file = "stage/posed.toml:";
  REQUIRE(sentence.starts_with(file));
  return sentence.substr(file.size());
}

// The same for a source with the stream of a body, which these lines end.
std::string body_complaint(const std::string& more) {
  return source_complaint(std::string(kOptitrack) + kAnn + more);
}

TEST_CASE("a source with all of its bodies") {
  const Reading reading = read_sources(std::string(kOptitrack) + "streams = \"all\"\n");
  REQUIRE(reading.errors.empty());
  CHECK(reading.config.streams.empty());
  CHECK(reading.config.max_streams == 64);
  REQUIRE(reading.config.sources.size() == 1);
  const SourceConfig& source = reading.config.sources[0];
  CHECK(source.name == "optitrack");
  CHECK(source.driver == "mocap");
  CHECK(source.rate_hz == 0.0);
  CHECK(source.all);
  CHECK(source.named.empty());
  CHECK(std::get<std::string>(source.options.at("listen")) == "here");
  CHECK(source.every.name.empty());
  CHECK(source.every.driver.empty());
  CHECK_FALSE(source.every.publish_raw);
  CHECK(source.every.default_stages);
  CHECK(source.every.stages.empty());
}

TEST_CASE("every value of a source and its bodies is stored in its field") {
  // Streams and sources may stand in any order.
  const Reading reading = read_sources(R"(max_streams = 8
[[stream]]
name = "ann"
source = "optitrack"
body = "Ann Ünal"
publish_raw = true
stale_after_s = 2
stages = ["constrain", "style"]
[stream.style]
model = "ann.style"
[[stream]]
name = "right"
driver = "glove"
[[source]]
name = "optitrack"
driver = "mocap"
rate_hz = 120
streams = "all"
publish_raw = true
stale_after_s = 3
[source.mocap]
listen = "there"
rate_hz = 240
[source.style]
model = "walk.style"
alpha = 0.5
[source.constrain]
enabled = false
[[stream]]
name = "bob"
source = "optitrack"
body = "Bob"
[[source]]
name = "room"
driver = "cameras"
streams = "all"
[source.cameras]
file = "room.txt"
)");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  CHECK(reading.config.max_streams == 8);
  REQUIRE(reading.config.streams.size() == 1);
  CHECK(reading.config.streams[0].name == "right");
  REQUIRE(reading.config.sources.size() == 2);
  CHECK(std::get<std::string>(reading.config.sources[1].options.at("file")) == "stage/room.txt");
  const SourceConfig& source = reading.config.sources[0];
  CHECK(source.rate_hz == 120.0);
  CHECK(std::get<std::string>(source.options.at("listen")) == "there");
  CHECK(std::get<double>(source.options.at("rate_hz")) == 240.0);
  CHECK(source.all);
  CHECK(source.every.publish_raw);
  CHECK(source.every.stale_after_s == 3.0);
  REQUIRE(source.every.stages.size() == 1);
  CHECK(source.every.stages[0].model == "stage/walk.style");
  CHECK(parameter<double>(source.every.stages[0].parameters, "alpha") == 0.5);
  REQUIRE(source.every.off.size() == 1);
  CHECK(source.every.off[0]->name == "constrain");
  REQUIRE(source.named.size() == 2);
  CHECK(source.named[0].body == "Ann Ünal");
  const StreamConfig& ann = source.named[0].stream;
  CHECK(ann.name == "ann");
  CHECK(ann.driver.empty());
  CHECK(ann.options.empty());
  CHECK(ann.calibration.empty());
  CHECK(ann.publish_raw);
  CHECK(ann.stale_after_s == 2.0);
  CHECK_FALSE(ann.default_stages);
  REQUIRE(ann.stages.size() == 2);
  CHECK(ann.stages[1].model == "stage/ann.style");
  CHECK(source.named[1].body == "Bob");
  CHECK(source.named[1].stream.name == "bob");
}

TEST_CASE("a config without streams and sources names both") {
  CHECK(source_complaint("").ends_with(
      "there is no stream and no source; add a [[stream]] table with a name and a driver, or a"
      " [[source]] table for a device with several bodies"));
}

TEST_CASE("a source: its name, driver, rate and streams are checked") {
  const std::string all = "streams = \"all\"\n";
  const auto named = [&](const std::string& name, const std::string& more) {
    return "[[source]]\nname = \"" + name + "\"\ndriver = \"mocap\"\n" + more;
  };
  const auto driven = [&](const std::string& driver) {
    return "[[source]]\nname = \"a\"\ndriver = \"" + driver + "\"\n" + all;
  };
  CHECK(source_complaint("[[source]]\ndriver = \"mocap\"\n" + all) ==
        "1: source.name is missing; give it a text in quotes");
  CHECK(source_complaint("[[source]]\nname = \"a\"\n" + all) ==
        "1: source.driver is missing; give it a text in quotes");
  CHECK(source_complaint(named("Opti", all)) ==
        "2: a source's name has 1 to 32 of the letters a-z, digits, '-' and '_'");
  CHECK(source_complaint(named("", all)).starts_with("2: a source's name has 1 to 32"));
  CHECK(source_complaint(named(std::string(21, 'a'), all)) ==
        "2: with streams = \"all\" a source's name has at most 20 letters, because the names of its"
        " streams begin with it");
  CHECK(read_sources(named(std::string(20, 'a'), all)).errors.empty());
  const std::string longest(32, 'a');
  CHECK(read_sources(named(longest, "[[stream]]\nname = \"b\"\nsource = \"" + longest +
                                        "\"\nbody = \"B\"\n"))
            .errors.empty());
  CHECK(source_complaint(driven("moca")) ==
        "3: there is no driver of this name; the nearest is 'mocap' (`posed devices` lists them)");
  CHECK(source_complaint(driven("motive")) ==
        "3: there is no driver of this name; the nearest is 'mocap' (`posed devices` lists them)");
  CHECK(source_complaint(driven("glove") + "port = \"x\"\n[source.glove]\n") ==
        "3: glove has one body; name it in a [[stream]] table with driver = \"glove\"");
  CHECK(source_complaint(driven("cameras")) ==
        "1: source.cameras.file is missing: the cameras' places");
  CHECK(
      source_complaint(named("a", all + "rate_hz = 0\n")).starts_with("5: source.rate_hz = 0 is"));
  CHECK(source_complaint(named("a", all + "rate_hz = 1001\n")).ends_with("from 1 to 1000"));
  CHECK(source_complaint(named("a", "streams = \"some\"\n")) ==
        "4: source.streams takes one value, \"all\"; leave it out to stream only the bodies that"
        " [[stream]] tables name");
  CHECK(source_complaint(named("a", "streams = true\n")) ==
        "4: source.streams must be text in quotes, not true or false");
  CHECK(source_complaint(named("a", "")) ==
        "1: nothing of source 'a' would be streamed; add streams = \"all\", or a [[stream]] table"
        " with source and body for each body");
  CHECK(source_complaint("source = 5\n").contains("a list of tables ([[source]])"));
}

TEST_CASE("settings of a source need streams = \"all\"") {
  const auto setting = [](const std::string& line) {
    return source_complaint(kOptitrack + line + kAnn);
  };
  CHECK(setting("publish_raw = true\n") ==
        "4: source.publish_raw is for the bodies of streams = \"all\"; add that line, or write it"
        " into the [[stream]] table of a body");
  CHECK(setting("stale_after_s = 1\n").starts_with("4: source.stale_after_s is for the bodies"));
  CHECK(setting("stages = []\n").starts_with("4: source.stages is for the bodies"));
  CHECK(setting("[source.constrain]\n").starts_with("4: [source.constrain] is for the bodies"));
}

TEST_CASE("errors in the stages of a source name its tables") {
  const auto setting = [](const std::string& lines) {
    return source_complaint(std::string(kOptitrack) + "streams = \"all\"\n" + lines);
  };
  CHECK(setting("stages = [\"style\"]\n") ==
        "5: stage style needs a model; add a [source.style] table with model = \"FILE\"");
  CHECK(setting("stages = []\n[source.constrain]\n") ==
        "5: [source.constrain] is there, but constrain is not in this list; add it, or leave out"
        " its table");
  CHECK(setting("[source.style]\nalpha = 1\n")
            .starts_with("5: source.style.model is missing; give it"));
  CHECK(setting("[source.style]\nmodel = \"m\"\nalpha = 3\n")
            .starts_with("7: source.style.alpha = 3 is out of range"));
  CHECK(setting("[source.constrain]\n[source.constrain]\n")
            .contains("cannot redefine existing table 'source.constrain'"));
}

TEST_CASE("a stage that needs the source's pose is refused behind one that loses it") {
  const auto with = [](const std::string& stages, const std::string& tables = "") {
    return std::string(kOptitrack) + "streams = \"all\"\nstages = " + stages + "\n" + tables;
  };
  CHECK(source_complaint(with("[\"generate\", \"feet\"]")) ==
        "5: feet needs the pose as the source gave it, which generate does not hand on; put feet"
        " before generate");
  CHECK(read_sources(with("[\"feet\", \"generate\"]")).errors.empty());
  CHECK(read_sources(with("[\"generate\", \"feet\"]", "[source.generate]\nenabled = false\n"))
            .errors.empty());
}

TEST_CASE("a stream of a source: source and body") {
  CHECK(read_sources(std::string(kOptitrack) + kAnn).errors.empty());
  CHECK(source_complaint(std::string(kOptitrack) + "streams = \"all\"\n" +
                         "[[stream]]\nname = \"ann\"\nsource = \"optitrack\"\n") ==
        "5: stream.body is missing; give it a text in quotes");
  CHECK(source_complaint(std::string(kOptitrack) + "streams = \"all\"\n" +
                         "[[stream]]\nname = \"ann\"\nbody = \"Ann\"\n") ==
        "5: stream.source is missing; give it a text in quotes");
  const auto of_body = [](const std::string& body) {
    return kOptitrack + std::string("[[stream]]\nname = \"a\"\nsource = \"optitrack\"\nbody = \"") +
           body + "\"\n";
  };
  CHECK(read_sources(of_body(std::string(64, 'x'))).errors.empty());
  const std::string wrong_body =
      "7: stream.body is the device's own name for the body, 1 to 64 bytes";
  CHECK(source_complaint(of_body("")) == wrong_body);
  CHECK(source_complaint(of_body(std::string(65, 'x'))) == wrong_body);
  const auto of_source = [](const std::string& source) {
    return kOptitrack + std::string("streams = \"all\"\n[[stream]]\nname = \"a\"\nsource = \"") +
           source + "\"\nbody = \"A\"\n";
  };
  CHECK(source_complaint(of_source("optitrak")) ==
        "7: there is no [[source]] table named 'optitrak'; the nearest is 'optitrack'");
  CHECK(source_complaint(of_source("vicon")) ==
        "7: there is no [[source]] table named 'vicon'; add one with the device's driver");
  CHECK(source_complaint(std::string(kAnn)).starts_with("3: there is no [[source]] table named"));
}

TEST_CASE("a stream of a source has no device of its own") {
  CHECK(body_complaint("driver = \"glove\"\nport = \"x\"\n[stream.glove]\n") ==
        "8: a stream has a driver or a source; leave out the driver to stream a body of the source,"
        " or source and body to open a device with one body");
  CHECK(body_complaint("calibration = \"a.toml\"\n") ==
        "8: calibration is for a glove, and this stream is a body of a source; leave it out");
  CHECK(body_complaint("port = \"x\"\n") ==
        "8: port says which device it is, and this stream's device is that of its source; leave it"
        " out");
  CHECK(body_complaint("[stream.mocap]\nlisten = \"x\"\n") ==
        "8: [stream.mocap] has a driver's options, and this stream's device is that of its source;"
        " they stand in [source.mocap]");
  CHECK(source_complaint("[[stream]]\nname = \"a\"\ndriver = \"glove\"\nbody = \"A\"\n") ==
        "4: body says which body of a source it is; write source = \"NAME\" in place of the driver,"
        " or leave body out");
  CHECK(source_complaint("[[stream]]\nname = \"a\"\ndriver = \"cameras\"\n[stream.cameras]\n") ==
        "3: cameras delivers several bodies; name it in a [[source]] table, and in [[stream]]"
        " tables one body each, with source and body");
}

TEST_CASE("names of sources, streams and bodies are unique") {
  const std::string all = "streams = \"all\"\n";
  CHECK(source_complaint(kOptitrack + all + kOptitrack + all) ==
        "5: a second source is named 'optitrack' (the first stands in line 1); every source has its"
        " own name");
  const std::string glove = "[[stream]]\nname = \"optitrack\"\ndriver = \"glove\"\n";
  CHECK(source_complaint(kOptitrack + all + glove) ==
        "5: a stream is named 'optitrack' like the source in line 1; streams and sources have"
        " different names");
  CHECK(source_complaint(glove + kOptitrack + all) ==
        "4: a source is named 'optitrack' like the stream in line 1; streams and sources have"
        " different names");
  CHECK(body_complaint("[[stream]]\nname = \"ann\"\ndriver = \"glove\"\n")
            .starts_with("8: a second stream is named 'ann' (the first stands in line 4)"));
  CHECK(body_complaint("publish_raw = true\n[[stream]]\nname = \"ann-raw\"\ndriver = \"glove\"\n")
            .starts_with("9: 'ann-raw' is the name under which the raw input of 'ann'"));
  CHECK(body_complaint("[[stream]]\nname = \"b\"\nsource = \"optitrack\"\nbody = \"Ann\"\n") ==
        "11: a second stream has body 'Ann' of source 'optitrack' (the first stands in line 4); a"
        " body is one stream");
  // Two sources may each have a body of this name.
  CHECK(read_sources(std::string(kOptitrack) + kAnn +
                     "[[source]]\nname = \"b\"\ndriver = \"mocap\"\n[[stream]]\nname = \"ann-b\"\n"
                     "source = \"b\"\nbody = \"Ann\"\n")
            .errors.empty());
}

TEST_CASE("max_streams limits the streams that the config names") {
  const auto streams = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += "[[stream]]\nname = \"g" + std::to_string(i) + "\"\ndriver = \"glove\"\n";
    }
    return text;
  };
  CHECK(source_complaint("max_streams = 0\n" + streams(1)) ==
        "1: max_streams = 0 is out of range: it takes an integer from 1 to 256");
  CHECK(source_complaint("max_streams = 257\n" + streams(1)).ends_with("from 1 to 256"));
  CHECK(source_complaint("max_streams = 9223372036854775807\n" + streams(1))
            .starts_with("1: max_streams = 9"));
  CHECK(source_complaint("max_streams = 2.5\n" + streams(1)) ==
        "1: max_streams must be an integer, not a number");
  CHECK(read_sources(streams(64)).errors.empty());
  CHECK(
      source_complaint(streams(65))
          .ends_with("there are 65 [[stream]] tables, but max_streams is 64; it takes up to 256"));
  CHECK(
      source_complaint("max_streams = 1\n" + streams(2)).starts_with("1: there are 2 [[stream]]"));
  const Reading most = read_sources("max_streams = 256\n" + streams(256));
  CHECK(most.errors.empty());
  CHECK(most.config.max_streams == 256);
  CHECK(source_complaint("max_streams = 256\n" + streams(257)).contains("at most 256"));
}

TEST_CASE("the error for an unknown key tells a source's table from a stream's") {
  const std::string source = std::string(kOptitrack) + "streams = \"all\"\n";
  CHECK(source_complaint(source + "lisen = \"x\"\n[source.mocap]\n").starts_with("5: unknown key"));
  CHECK(source_complaint(source + "listen = \"x\"\n") ==
        "5: unknown key 'source.listen'; it belongs in [source.mocap]");
  CHECK(source_complaint(source + "alpha = 1\n") ==
        "5: unknown key 'source.alpha'; it belongs in [source.style]");
  CHECK(source_complaint(source + "[source.mocap]\npublish_raw = true\n") ==
        "6: unknown key 'source.mocap.publish_raw'; it belongs in [source]");
  CHECK(source_complaint(source + "body = \"A\"\n") ==
        "5: unknown key 'source.body'; it belongs in [stream]");
  CHECK(body_complaint("alpha = 1\n") ==
        "8: unknown key 'stream.alpha'; it belongs in [stream.style]");
  CHECK(body_complaint("streams = \"all\"\n") ==
        "8: unknown key 'stream.streams'; it belongs in [source]");
  CHECK(body_complaint("boddy = \"B\"\n") ==
        "8: unknown key 'stream.boddy'; the nearest known one here is 'body'");
  CHECK(body_complaint("[[streams]]\n") == "8: unknown key 'streams'; it belongs in [source]");
}

}  // namespace
}  // namespace posed::config
