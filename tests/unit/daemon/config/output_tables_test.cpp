#include <catch2/catch.hpp>

#include "daemon/config/config.hpp"

namespace posed::config {
namespace {

Result<std::unique_ptr<drivers::SourceLayout>> no_bodies(std::span<const std::byte>) {
  return fail("not used here");
}

Reading read_with_outputs(const std::string& text) {
  static const std::vector<drivers::Driver> drivers = [] {
    drivers::Driver glove{.name = "glove",
                          .summary = "a hand",
                          .options = {},
                          .open = nullptr,
                          .make_decoder = nullptr,
                          .describe = nullptr};
    drivers::Driver mocap = glove;
    mocap.name = "mocap";
    mocap.make_layout = no_bodies;
    return std::vector{glove, mocap};
  }();
  return read_config(R"([[stream]]
name = "left"
driver = "glove"
[[source]]
name = "stage"
driver = "mocap"
streams = "all"
[[stream]]
name = "ann"
source = "stage"
body = "Ann"
)" + text,
                     "posed.toml", drivers);
}

// The only error, with its line.
std::string output_complaint(const std::string& text) {
  const Reading reading = read_with_outputs(text);
  INFO(text);
  for (const Error& error : reading.errors) UNSCOPED_INFO(error.text());
  REQUIRE(reading.errors.size() == 1);
  CHECK(reading.errors[0].exit_code == ExitCode::kWrongUse);
  return reading.errors[0].text();
}

const std::string kToAnn = R"([[output]]
kind = "vmc"
body = "ann"
)";
const std::string kTo = "to = [\"127.0.0.1:39539\"]\n";

}  // namespace

TEST_CASE("no receiver gets two people who look like one") {
  const std::string stage = "[[output]]\nkind = \"vmc\"\nbody = \"stage-bob\"\n";
  CHECK(output_complaint(kToAnn + kTo + stage + kTo) ==
        "posed.toml:19: '127.0.0.1:39539' would take two outputs for one: that in line 12"
        " sends to it, too; give each a port");
  const std::string hands = "[[output]]\nkind = \"vmc\"\nleft_hand = \"left\"\n";
  const std::string mvn = "[[output]]\nkind = \"mvn\"\nbody = \"ann\"\n";
  const Reading reading = read_with_outputs(kToAnn + kTo + hands + kTo + mvn + kTo);
  CHECK(reading.errors.empty());
}

TEST_CASE("an output is read with its defaults, and named by kind and stream") {
  const Reading reading = read_with_outputs(kToAnn + kTo + R"([[output]]
name = "hands"
kind = "vmc"
left_hand = "left"
right_hand = "stage-bob"
to = ["127.0.0.1:39540", "[::1]:39540", "192.168.1.20:39540"]
rate_hz = 60
names = "vrm1"
role = "assistant"
)");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  REQUIRE(reading.config.outputs.size() == 2);
  const OutputConfig& first = reading.config.outputs[0];
  CHECK(first.name == "vmc-ann");
  CHECK(first.kind == OutputKind::kVmc);
  CHECK(first.body == "ann");
  CHECK(first.to == std::vector<std::string>{"127.0.0.1:39539"});
  CHECK(first.rate_hz == 0.0);
  CHECK_FALSE(first.vrm1_names);
  CHECK_FALSE(first.assistant);
  const OutputConfig& second = reading.config.outputs[1];
  CHECK(second.name == "hands");
  CHECK(second.body.empty());
  CHECK(second.left_hand == "left");
  CHECK(second.right_hand == "stage-bob");
  CHECK(second.to.size() == 3);
  CHECK(second.rate_hz == 60.0);
  CHECK(second.vrm1_names);
  CHECK(second.assistant);
}

TEST_CASE("a wrong output is one sentence with its line") {
  CHECK(output_complaint("[[output]]\nbody = \"ann\"\n" + kTo) ==
        "posed.toml:12: output.kind is missing; write kind = \"vmc\" or \"bvh\" or \"axis\" or "
        "\"mvn\""
        " or \"mocopi\" or \"rokoko\" or \"natnet\" or \"ros2\"");
  CHECK(output_complaint("[[output]]\nkind = \"vcm\"\nbody = \"ann\"\n" + kTo)
            .find("posed.toml:13: output.kind must be one of these words") == 0);
  CHECK(output_complaint("[[output]]\nkind = \"vmc\"\n" + kTo) ==
        "posed.toml:12: the output names no stream; add body = \"STREAM\", left_hand or"
        " right_hand");
  CHECK(output_complaint("[[output]]\nkind = \"vmc\"\nbody = \"anne\"\n" + kTo) ==
        "posed.toml:14: there is no stream named 'anne'; the nearest is 'ann'");
  CHECK(output_complaint("[[output]]\nkind = \"vmc\"\nbody = \"stage\"\n" + kTo)
            .find("posed.toml:14: there is no stream named 'stage'; name that of a") == 0);
  CHECK(output_complaint("[[output]]\nkind = \"vmc\"\nbody = 3\n" + kTo).find("posed.toml:14: ") ==
        0);
  CHECK(output_complaint(kToAnn + "left_hand = \"ann\"\n" + kTo) ==
        "posed.toml:15: 'ann' is another part of this avatar already; each part has a stream of"
        " its own");
  CHECK(output_complaint(kToAnn) ==
        "posed.toml:12: output.to is missing; name the receivers, like to = [\"127.0.0.1:39539\"]");
  CHECK(output_complaint(kToAnn + "to = []\n") ==
        "posed.toml:15: output.to takes 1 to 64 receivers");
  CHECK(output_complaint(kToAnn + "to = \"127.0.0.1:39539\"\n").find("posed.toml:15: ") == 0);
  for (const char* endpoint : {"localhost:39539", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0",
                               "127.0.0.1:65536", "127.0.0.1:99999999999999999999", ":39539", ""}) {
    CHECK(output_complaint(kToAnn + "to = [\"" + endpoint + "\"]\n") ==
          "posed.toml:15: '" + std::string(endpoint) +
              "' should be an address and a port from 1 to 65535, like 127.0.0.1:39539");
  }
  for (const char* port : {"\\u0000", "+1", "1 ", "\\u001b[2J"}) {
    const std::string sentence = output_complaint(kToAnn + "to = [\"127.0.0.1:" + port + "\"]\n");
    CHECK(sentence.find("should be an address and a port") != std::string::npos);
    CHECK(sentence.find('\x1b') == std::string::npos);
  }
  CHECK(output_complaint(kToAnn + "to = [\"127.0.0.1:1\", \"127.0.0.1:1\"]\n")
            .find("'127.0.0.1:1' is listed twice") != std::string::npos);
  CHECK(output_complaint(kToAnn + kTo + "rate_hz = -1\n").find("out of range") !=
        std::string::npos);
  CHECK(output_complaint(kToAnn + kTo + "names = \"vrm2\"\n").find("vrm0, vrm1") !=
        std::string::npos);
  CHECK(output_complaint(kToAnn + kTo + "role = \"marionette\"\n").find("assistant") !=
        std::string::npos);
  CHECK(output_complaint(kToAnn + kTo + "name = \"Ann!\"\n").find("an output's name has 1 to 32") !=
        std::string::npos);
  CHECK(output_complaint(kToAnn + kTo + kToAnn + "to = [\"127.0.0.1:39540\"]\n") ==
        "posed.toml:16: a second output is named 'vmc-ann' (the first stands in line 12); give one"
        " of them another name");
  CHECK(output_complaint(kToAnn + kTo + "colour = 1\n").find("unknown key 'output.colour'") !=
        std::string::npos);
}

TEST_CASE("a BVH output listens on this machine, or names who may connect") {
  const std::string bvh = "[[output]]\nkind = \"bvh\"\nbody = \"ann\"\n";
  const Reading reading = read_with_outputs(bvh + R"([[output]]
name = "open"
kind = "bvh"
body = "ann"
listen = "0.0.0.0:7003"
peers = ["192.168.1.20"]
header = true
)");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  REQUIRE(reading.config.outputs.size() == 2);
  CHECK(reading.config.outputs[0].name == "bvh-ann");
  CHECK(reading.config.outputs[0].kind == OutputKind::kBvh);
  CHECK(reading.config.outputs[0].listen == "127.0.0.1:7002");
  CHECK_FALSE(reading.config.outputs[0].header);
  CHECK(reading.config.outputs[1].listen == "0.0.0.0:7003");
  CHECK(reading.config.outputs[1].peers == std::vector<std::string>{"192.168.1.20"});
  CHECK(reading.config.outputs[1].header);
  CHECK(output_complaint(bvh + "listen = \"0.0.0.0:7002\"\n").find("in peers") !=
        std::string::npos);
  CHECK(output_complaint(bvh + "listen = \"here\"\n").find("posed.toml:15: 'here' should be") == 0);
  CHECK(output_complaint(bvh + "listen = \"\\u001b[2J\"\n").find('\x1b') == std::string::npos);
  CHECK(output_complaint(bvh + "listen = \"127.0.0.1:0\"\n").find("choose one from 1 to 65535") !=
        std::string::npos);
  CHECK(output_complaint(bvh + "peers = [\"studio\"]\n").find("'studio' should be an address") !=
        std::string::npos);
  CHECK(output_complaint(bvh + "to = [\"127.0.0.1:39539\"]\n") ==
        "posed.toml:15: to is for outputs of kind = \"vmc\" or \"axis\" or \"mvn\" or \"mocopi\" or"
        " \"rokoko\"; leave it out");
  CHECK(output_complaint(bvh + "left_hand = \"left\"\n").find("is for outputs of kind = \"vmc\"") !=
        std::string::npos);
  CHECK(
      output_complaint(kToAnn + kTo + "header = true\n").find("is for outputs of kind = \"bvh\"") !=
      std::string::npos);
  CHECK(output_complaint("[[output]]\nkind = \"bvh\"\n") ==
        "posed.toml:12: the output names no stream; add body = \"STREAM\"");
}

TEST_CASE("outputs of a device's protocol name people and receivers, or listen") {
  const Reading reading = read_with_outputs(R"([[output]]
kind = "mvn"
bodies = ["ann", "stage-bob"]
to = ["127.0.0.1:9763"]
format = "euler"
[[output]]
kind = "natnet"
body = "ann"
group = "239.255.42.99"
data_port = 1600
version = "3.0"
[[output]]
kind = "rokoko"
body = "ann"
to = ["127.0.0.1:14043"]
format = "json"
)");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  REQUIRE(reading.config.outputs.size() == 3);
  CHECK(reading.config.outputs[0].name == "mvn-ann");
  CHECK(reading.config.outputs[0].bodies == std::vector<std::string>{"ann", "stage-bob"});
  CHECK(reading.config.outputs[0].euler);
  CHECK(reading.config.outputs[1].listen == "127.0.0.1:1510");
  CHECK(reading.config.outputs[1].group == "239.255.42.99");
  CHECK(reading.config.outputs[1].data_port == 1600);
  CHECK(reading.config.outputs[1].version == "3.0");
  CHECK_FALSE(reading.config.outputs[2].lz4);

  const std::string mvn = "[[output]]\nkind = \"mvn\"\n", to = "to = [\"127.0.0.1:9763\"]\n";
  const std::string natnet = "[[output]]\nkind = \"natnet\"\nbody = \"ann\"\n";
  CHECK(output_complaint(mvn + "body = \"ann\"\n") ==
        "posed.toml:12: output.to is missing; name the receivers, like to = [\"127.0.0.1:9763\"]");
  CHECK(output_complaint(mvn + "bodies = [\"ann\", \"anne\"]\n" + to) ==
        "posed.toml:14: there is no stream named 'anne'; the nearest is 'ann'");
  CHECK(output_complaint(mvn + "bodies = [\"ann\", \"ann\"]\n" + to) ==
        "posed.toml:14: 'ann' is listed twice; it would be sent as two people");
  CHECK(output_complaint(mvn + "bodies = []\n" + to) ==
        "posed.toml:14: output.bodies takes 1 to 16 streams");
  CHECK(output_complaint("[[output]]\nkind = \"rokoko\"\nbodies = []\n" + to) ==
        "posed.toml:14: output.bodies takes 1 to 5 streams");
  CHECK(output_complaint(mvn + "body = \"ann\"\nbodies = [\"stage-bob\"]\n" + to) ==
        "posed.toml:15: body names one person and bodies several: leave one out");
  CHECK(output_complaint(mvn + "body = \"ann\"\nformat = \"unity\"\n" + to)
            .find("quaternion, euler") != std::string::npos);
  CHECK(output_complaint("[[output]]\nkind = \"mocopi\"\nbodies = [\"ann\"]\n" + to)
            .find("bodies is for outputs of kind = \"axis\"") != std::string::npos);
  CHECK(output_complaint(natnet + "group = \"192.168.1.1\"\n") ==
        "posed.toml:15: '192.168.1.1' should be a multicast group, like 239.255.42.99");
  CHECK(output_complaint(natnet + "listen = \"::1\"\ngroup = \"239.255.42.99\"\n") ==
        "posed.toml:16: to send to a group, listen must be an IPv4 address");
  CHECK(output_complaint(natnet + "version = \"2.5\"\n").find("one of these words") <
        std::string::npos);
  CHECK(output_complaint(natnet + "data_port = 70000\n").find("out of range") != std::string::npos);
  CHECK(output_complaint(natnet + "listen = \"0.0.0.0\"\n").find("in peers") != std::string::npos);
  CHECK(output_complaint(natnet + natnet + "name = \"second\"\n") ==
        "posed.toml:15: output 'natnet-ann' and output 'second' cannot share the UDP endpoint"
        " 127.0.0.1:1510; give output 'second' another port");
}

TEST_CASE("an output to ROS 2 names its streams, its domain and who else may hear") {
  const std::string ros2 = "[[output]]\nkind = \"ros2\"\n", ann = "streams = [\"ann\"]\n";
  const Reading reading =
      read_with_outputs(ros2 + ann + "trajectory = true\ndomain = 42\ntopic = \"a/b_1\"\n" +
                        "interface = \"eth0\"\npeers = [\"192.168.1.20\"]\n");
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  REQUIRE(reading.config.outputs.size() == 1);
  const OutputConfig& output = reading.config.outputs[0];
  CHECK(output.name == "ros2-ann");
  CHECK(output.bodies == std::vector<std::string>{"ann"});
  CHECK(output.trajectory);
  CHECK(output.interface == "eth0");

  CHECK(output_complaint(ros2) ==
        "posed.toml:12: output.streams is missing; name what is sent, like streams = [\"actor1\"]");
  CHECK(output_complaint(ros2 + "body = \"ann\"\n" + ann).find("leave it out") !=
        std::string::npos);
  CHECK(output_complaint(ros2 + ann + "peers = [\"192.168.1.20\"]\n") ==
        "posed.toml:15: other computers are not on \"lo\"; name the interface to them");
  CHECK(output_complaint(ros2 + ann + "interface = \"lo\\\"/>\"\n") ==
        "posed.toml:15: name one network interface, as `ip -4 address` does");
  for (const std::string topic : {"/cmd", "a//b", "a/", "1a", "a b", "a-b", "a/2"}) {
    CHECK(output_complaint(ros2 + ann + "topic = \"" + topic + "\"\n").find("a topic is words") !=
          std::string::npos);
  }
  CHECK(output_complaint(ros2 + "streams = [\"ann\", \"stage-bob\"]\ntopic = \"a\"\n")
            .find("give each an [[output]] of its own") != std::string::npos);
  CHECK(output_complaint(ros2 + ann + ros2 + "streams = [\"stage-bob\"]\ninterface = \"eth0\"\n")
            .find("write the same in both") != std::string::npos);
}

TEST_CASE("the stream of a right hand is no left hand") {
  const auto errors_of = [](const std::string& stream, const std::string& hands) {
    return read_config("[[stream]]\nname = \"glove\"\ndriver = \"cyberglove\"\n" + stream +
                           "[[output]]\nkind = \"vmc\"\n" + hands + kTo,
                       "posed.toml", drivers::registry())
        .errors;
  };
  CHECK(errors_of("hand = \"left\"\n", "left_hand = \"glove\"\n").empty());
  CHECK(errors_of("", "right_hand = \"glove\"\n").empty());  // a glove is right by default
  const auto errors = errors_of("", "left_hand = \"glove\"\n");
  REQUIRE(errors.size() == 1);
  CHECK(errors[0].text() ==
        "posed.toml:6: 'glove' is a right hand; name it as right_hand, or set hand = \"left\" in"
        " its [[stream]] table");
  CHECK(errors_of("hand = \"left\"\n", "right_hand = \"glove\"\n").size() == 1);
}

}  // namespace posed::config
