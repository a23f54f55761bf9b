// What events say: what was changed from what into what, not only that something was.
#include "daemon/publish/notice_text.hpp"

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"

namespace posed::publish {
namespace {

using pipeline::Change;
using pipeline::Notice;
using pipeline::ShortText;

Notice notice_of(v1::Event::Kind kind) { return {0, static_cast<std::uint8_t>(kind), 0, 61, 0.0}; }

TEST_CASE("a change is told with what was before and what is now") {
  Notice notice = notice_of(v1::Event::KIND_CONTROL);
  notice.alpha_before = 1.0F;
  notice.value = 0.5;
  CHECK(sentence(notice) == "alpha 1.00 -> 0.50 from frame 61");
  notice.change = Change::kStyleModel;
  notice.before = ShortText("march.style");
  notice.after = ShortText("x.style");
  CHECK(sentence(notice) == "style model march.style -> x.style from frame 61");
  notice.change = Change::kGestureModel;
  notice.before = {};
  CHECK(sentence(notice) == "gesture model x.style from frame 61");
  notice.change = Change::kStopPlaying;
  CHECK(sentence(notice) == "stops performing at frame 61");
  notice = notice_of(v1::Event::KIND_CALIBRATED);
  notice.after = ShortText("ann.toml");
  CHECK(sentence(notice) == "calibration ann.toml from frame 62");
  notice = notice_of(v1::Event::KIND_PLAYING);
  notice.value = 2.0;
  notice.after = ShortText("g c");
  CHECK(sentence(notice) == "performs 2 labels (g c) from frame 61 on, or after those that wait");
}

TEST_CASE("foreign names in an event are cleaned and cut between two characters") {
  Notice notice = notice_of(v1::Event::KIND_CALIBRATED);
  notice.after = ShortText("\x1b[2Jevil");
  CHECK(sentence(notice).find('\x1b') == std::string::npos);
  std::string umlauts = "x";
  while (umlauts.size() < 300) umlauts += "\xc3\xa4";
  const ShortText text(umlauts);
  CHECK(text.cut());
  CHECK(text.text().size() % 2 == 1);  // no half of the last one
  CHECK(umlauts.starts_with(text.text()));
  notice.after = text;
  CHECK(sentence(notice).contains("... from frame"));
}

}  // namespace
}  // namespace posed::publish
