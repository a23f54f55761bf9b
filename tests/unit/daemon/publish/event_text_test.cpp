// The text of events names the old and the new value, not only that something changed.
#include "daemon/publish/event_text.hpp"

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"

namespace posed::publish {
namespace {

using pipeline::Change;
using pipeline::ShortText;
using pipeline::StreamEvent;

StreamEvent event_of(v1::Event::Kind kind) {
  return {0, static_cast<std::uint8_t>(kind), 0, 61, 0.0};
}

TEST_CASE("the text of a change names the old and the new value") {
  StreamEvent event = event_of(v1::Event::KIND_CONTROL);
  event.alpha_before = 1.0F;
  event.value = 0.5;
  CHECK(sentence(event) == "alpha 1.00 -> 0.50 from frame 61");
  event.change = Change::kStyleModel;
  event.before = ShortText("march.style");
  event.after = ShortText("x.style");
  CHECK(sentence(event) == "style model march.style -> x.style from frame 61");
  event.change = Change::kGestureModel;
  event.before = {};
  CHECK(sentence(event) == "gesture model x.style from frame 61");
  event.change = Change::kStopPlaying;
  CHECK(sentence(event) == "stops performing at frame 61");
  event = event_of(v1::Event::KIND_CALIBRATED);
  event.after = ShortText("ann.toml");
  CHECK(sentence(event) == "calibration ann.toml from frame 62");
  event = event_of(v1::Event::KIND_PLAYING);
  event.value = 2.0;
  event.after = ShortText("g c");
  CHECK(sentence(event) == "performs 2 labels (g c) from frame 61 on, or after those that wait");
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
}

}  // namespace
}  // namespace posed::publish
