// The bend5 glove: its line, and what its decoder makes of damage.
#include <catch2/catch.hpp>

#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"

namespace posed::drivers {
namespace {

void decode_bends(std::string_view text, test::CollectSink& sink) {
  test::decoder_of(*find_driver("bend5"), {})->feed(std::as_bytes(std::span(text)), 0, sink);
}

}  // namespace

TEST_CASE("a line of bend5 is five bends, thumb to little finger") {
  test::CollectSink sink;
  decode_bends("1023,600,12,0,512\n", sink);
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.samples[0].value[0] == 1.0F);
  CHECK(sink.samples[0].value[1] == Approx(600.0 / 1023.0));
  CHECK(sink.frames.size() == 1);
}

TEST_CASE("a line of bend5 that lacks a value, or has one too many or too large, is counted") {
  test::CollectSink sink;
  decode_bends("1,2,3,4\n1,2,3,4,5,6\n1,2,3,4,1024\n", sink);
  CHECK(sink.count(Outcome::kForeign) == 2);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  CHECK(sink.frames.empty());
}

}  // namespace posed::drivers
