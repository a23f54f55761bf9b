// The bend5 glove: its line, and what its decoder makes of damage.
#include <catch2/catch.hpp>

#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"

namespace posed::drivers {
namespace {

test::CollectSink decoded_bends(std::string_view text) {
  test::CollectSink sink;
  test::decoder_of(*find_driver("bend5"), {})->feed(std::as_bytes(std::span(text)), 0, sink);
  return sink;
}

}  // namespace

TEST_CASE("a line of bend5 is five bends, thumb to little finger") {
  const auto sink = decoded_bends("1023,600,12,0,512\n");
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.samples[0].value[0] == 1.0F);
  CHECK(sink.samples[0].value[1] == Approx(600.0 / 1023.0));
  CHECK(sink.frames.size() == 1);
}

TEST_CASE("a line of bend5 that lacks a value, or has one too many or too large, is counted") {
  CHECK(decoded_bends("1,2,3,4\n").count(Outcome::kForeign) == 1);
  CHECK(decoded_bends("1,2,3,4,5,6\n").count(Outcome::kForeign) == 1);
  CHECK(decoded_bends("1,2,3,4,1024\n").count(Outcome::kOutOfRange) == 1);
}

}  // namespace posed::drivers
