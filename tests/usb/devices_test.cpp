// `posed devices` with gloves that umockdev simulates.
#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "drivers/transport/enumerate.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/hid_glove.hpp"
#include "tests/usb/p5_glove.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

json listed() {
  const ProgramOutcome outcome = posed({"devices", "--json"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return json::parse(outcome.out).at("devices");
}

json only(const json& devices, const std::string& node) {
  json found;
  int count = 0;
  for (const json& device : devices) {
    if (device.at("node") != node) continue;
    found = device;
    ++count;
  }
  REQUIRE(count == 1);
  return found;
}

}  // namespace

TEST_CASE("posed devices lists a glove on hidraw and a P5, before and after unplugging") {
  Bench bench;
  CHECK(listed().empty());
  HidGlove ultra(bench, kUltra);
  P5Glove p5(bench, kP5, {});
  ultra.plug();
  p5.plug();
  const json both = listed();
  CHECK(both.size() == 2);

  const json hid = only(both, ultra.node());
  CHECK(hid.at("bus") == "hid");
  CHECK(hid.at("id") == "ULTRA-7");
  CHECK(hid.at("vendor") == "5d70");
  CHECK(hid.at("product") == "0001");
  CHECK(hid.at("serial") == "ULTRA-7");
  CHECK(hid.at("port_path") == "1-2");
  CHECK(hid.at("name") == "5DT Data Glove Ultra");
  CHECK(hid.at("drivers") == json::parse(R"([{"name": "fivedt", "certain": true}])"));
  CHECK(hid.at("hand") == "left");
  CHECK(hid.at("open_error").is_null());

  const json usb = only(both, p5.node());
  CHECK(usb.at("bus") == "usb");
  CHECK(usb.at("id") == "1-3");  // it has no serial number, so its USB port path identifies it
  CHECK(usb.at("serial").is_null());
  CHECK(usb.at("port_path") == "1-3");
  CHECK(usb.at("name") == "Essential Reality P5 Virtual Reality");
  CHECK(usb.at("drivers") == json::parse(R"([{"name": "p5", "certain": true}])"));
  CHECK(usb.at("open_error").is_null());

  ultra.unplug();
  CHECK(listed().size() == 1);
  ultra.plug();
  CHECK(only(listed(), ultra.node()).at("id") == "ULTRA-7");
}

TEST_CASE("devices with equal serial numbers are bound by their USB ports") {
  Bench bench;
  UsbIds twin = kUltra;
  twin.port = 5;
  HidGlove one(bench, kUltra), other(bench, twin);
  one.plug();
  other.plug();
  const json both = listed();
  CHECK(only(both, one.node()).at("id") == "1-2");
  CHECK(only(both, other.node()).at("id") == "1-5");
}

TEST_CASE("a device with invalid strings and numbers is listed all the same") {
  Bench bench;
  UsbIds odd = kUltra;
  odd.serial = "\x1B[31m\xFF";
  odd.product_name = std::string(300, 'x') + "\x07";
  HidGlove glove(bench, odd);
  glove.plug();
  const json device = only(listed(), glove.node());
  CHECK(device.at("serial").get<std::string>().find('\x1B') == std::string::npos);
  CHECK(device.at("name").get<std::string>().find('\x07') == std::string::npos);
}

}  // namespace posed::test
