// The text of events names the old and the new value, not only that something changed.
#include "daemon/publish/event_text.hpp"

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"
#include "tests/support/stage_commands.hpp"

namespace posed::publish {
namespace {

using pipeline::StreamEvent;

StreamEvent event_of(v1::Event::Kind kind) {
  return {0, static_cast<std::uint8_t>(kind), 0, 61, 0.0};
}

TEST_CASE("the text of a change names the old and the new value") {
  StreamEvent event = event_of(v1::Event::KIND_CONTROL);
  event.value_before = 1.0;
  event.change = test::alpha_command(0, 0.5).change;
  CHECK(sentence(event) == "style.alpha 1 -> 0.5 from frame 61");
  event.change = test::model_command(0, style::style_type(), nullptr).change;
  event.before = ShortText("march.style");
  event.after = ShortText("x.style");
  CHECK(sentence(event) == "style model march.style -> x.style from frame 61");
  event.change = test::model_command(0, generate::generate_type(), nullptr).change;
  event.before = {};
  CHECK(sentence(event) == "generate model x.style from frame 61");
  event.change = test::stop_playing_command(0).change;
  event.after = {};
  CHECK(sentence(event) == "stop-playing at frame 61");
  event = event_of(v1::Event::KIND_CALIBRATED);
  event.after = ShortText("ann.toml");
  CHECK(sentence(event) == "calibration ann.toml from frame 62");
  event = event_of(v1::Event::KIND_PLAYING);
  event.after = ShortText("g c");
  CHECK(sentence(event) == "plays g c from frame 61 on, or after what still waits");
}

TEST_CASE("untrusted names in an event are cleaned and cut between two characters") {
  StreamEvent event = event_of(v1::Event::KIND_CALIBRATED);
  event.after = ShortText("\x1b[2Jevil");
  CHECK(sentence(event).find('\x1b') == std::string::npos);
  std::string umlauts = "x";
  while (umlauts.size() < 300) umlauts += "\xc3\xa4";
  const ShortText text(umlauts);
  CHECK(text.cut());
  CHECK(text.text().size() % 2 == 1);  // no half of a character
  CHECK(umlauts.starts_with(text.text()));
  event.after = text;
  CHECK(sentence(event).contains("... from frame"));
  CHECK(body_words("optitrack", "\x1b[2JAnn") == "body '\\x1b[2JAnn' of source optitrack");
}

}  // namespace
}  // namespace posed::publish
