// A glove's device info is read back key by key, and a damaged one gives one error
// message.
#include "drivers/glove/device_info.hpp"

#include <catch2/catch.hpp>

#include <array>

namespace posed::drivers::glove {
namespace {

constexpr std::array<std::string_view, 2> kForms{"alpha", "legacy"};

// Reads the device info of a fictitious glove and returns the error; empty when it is accepted.
std::string complaint(const std::string& text) {
  DeviceInfoReader reader(text, "toy", "A9");
  (void)reader.side();
  (void)reader.whole("sensors", 18, 22);
  (void)reader.choice("form", kForms);
  const auto ok = reader.finish();
  return ok ? std::string() : ok.error().text();
}

}  // namespace

TEST_CASE("device info gives back what a driver put into it") {
  DeviceInfoReader reader("toy form=legacy sensors=22 hand=left name=x=y", "toy", "A9");
  CHECK(reader.side() == Side::kLeft);
  CHECK(reader.whole("sensors", 18, 22) == 22);
  CHECK(reader.choice("form", kForms) == 1);
  CHECK(reader.word("name") == "x=y");
  CHECK(reader.finish());
}

TEST_CASE("damaged device info is refused, and the message states what is wrong") {
  CHECK(complaint("toy hand=right sensors=18 form=alpha").empty());
  CHECK(complaint("other hand=right sensors=18 form=alpha").find("its name") != std::string::npos);
  CHECK(complaint("toy hand=right form=alpha").find("lacks 'sensors'") != std::string::npos);
  CHECK(complaint("toy hand=right sensors=17 form=alpha").find("18 to 22") != std::string::npos);
  CHECK(complaint("toy hand=right sensors=18x form=alpha").find("18 to 22") != std::string::npos);
  CHECK(complaint("toy hand=up sensors=18 form=alpha").find("'hand'") != std::string::npos);
  CHECK(complaint("toy hand=right sensors= form=alpha").find("nothing") != std::string::npos);
  CHECK(complaint("toy hand=right sensors=18 form=alpha hand=left").find("twice") !=
        std::string::npos);
  CHECK(complaint("toy hand=right sensors=18 form=alpha more=1").find("does not know") !=
        std::string::npos);
  CHECK(complaint("toy hand right").find("key=value") != std::string::npos);
  CHECK(complaint("").starts_with("A9: "));
}

}  // namespace posed::drivers::glove
