// Any bytes as a BVH: accepted or refused, never a crash, a hang or a pose that is not finite.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "proto/clip/bvh.hpp"
#include "tests/fuzz/clip_checks.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto clip = posed::clip::parse_bvh(text, "fuzz.bvh");
  if (clip) posed::test::check_clip(*clip);
  return 0;
}
