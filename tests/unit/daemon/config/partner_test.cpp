// Streams that stages name as partners: each mistake is one sentence with file and line.
#include <catch2/catch.hpp>

#include "daemon/config/config.hpp"

namespace posed::config {
namespace {

// A left glove in line 2, a source in line 5 and a body of it, "ann", in line 9; its merge table
// begins in line 13.
constexpr const char* kStage = R"([[stream]]
name = "glove-l"
driver = "labels"
[[source]]
name = "room"
driver = "template_mocap"
streams = "all"
[[stream]]
name = "ann"
source = "room"
body = "Ann"
[stream.merge]
)";

std::string partner_complaint(const std::string& more) {
  const Reading reading = read_config(kStage + more, "stage/posed.toml", drivers::registry());
  INFO(more);
  for (const Error& error : reading.errors) UNSCOPED_INFO(error.text());
  REQUIRE(reading.errors.size() == 1);
  CHECK(reading.errors[0].exit_code == ExitCode::kWrongUse);
  return reading.errors[0].text();
}

}  // namespace

TEST_CASE("a body may name gloves") {
  const Reading reading =
      read_config(std::string(kStage) + "left = \"glove-l\"\nwait_ms = 20\nwrist = \"body\"\n",
                  "stage/posed.toml", drivers::registry());
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  const StageConfig& merge = reading.config.sources[0].named[0].stream.stages[0];
  CHECK(merge.type->name == "merge");
  CHECK(parameter<std::string>(merge.parameters, "left") == "glove-l");
  CHECK(parameter<double>(merge.parameters, "wait_s") == Approx(0.02));
}

TEST_CASE("any stream may be a partner: a body, one that comes later, one with partners itself") {
  const Reading reading =
      read_config(std::string(kStage) +
                      "left = \"room-bob\"\nright = \"later\"\n[[stream]]\nname = \"later\"\n"
                      "driver = \"labels\"\n[stream.merge]\nleft = \"glove-l\"\n",
                  "stage/posed.toml", drivers::registry());
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
}

TEST_CASE("a partner that cannot be one is refused with its line") {
  CHECK(partner_complaint("left = \"glove-r\"\n") ==
        "stage/posed.toml:13: merge.left: there is no stream 'glove-r'; the nearest is 'glove-l'");
  CHECK(partner_complaint("right = \"ann\"\n")
            .contains(":13: merge.right: 'ann' is this stream itself"));
  CHECK(partner_complaint("left = \"glove-l\"\nwrist = \"both\"\n").contains(":14: "));
  CHECK(partner_complaint("left = \"glove-l\"\nwait_ms = 101\n").contains("0 to 100"));
}

TEST_CASE("streams that need each other are refused") {
  const auto errors = [](const std::string& more) {
    std::vector<std::string> texts;
    const Reading reading = read_config(kStage + more, "posed.toml", drivers::registry());
    for (const Error& error : reading.errors) texts.push_back(error.text());
    return texts;
  };
  const std::vector<std::string> two = errors(
      "left = \"b\"\n[[stream]]\nname = \"b\"\ndriver = \"labels\"\n[stream.merge]\n"
      "left = \"ann\"\n");
  REQUIRE(two.size() == 2);
  CHECK(two[0].contains(":13: merge.left: stream 'b' needs this stream itself"));
  CHECK(two[1].contains(":18: merge.left: stream 'ann' needs this stream itself"));
  // The bodies that no table names count as one stream, so none of them can be another's partner.
  const std::vector<std::string> bodies = errors(
      "left = \"glove-l\"\n[[source]]\nname = \"hall\"\ndriver = \"template_mocap\"\n"
      "streams = \"all\"\n[source.template_mocap]\nlisten = \"127.0.0.1:9999\"\n"
      "[source.merge]\nleft = \"hall-bob\"\n");
  REQUIRE(bodies.size() == 1);
  CHECK(bodies[0].contains("merge.left: stream 'hall-bob' needs this stream itself"));
}

}  // namespace posed::config
