// Any bytes as an ASF and an AMC, separated by a line "%%": accepted or refused, never a crash.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "proto/clip/acclaim.hpp"
#include "tests/fuzz/clip_checks.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t cut = std::min(text.find("%%"), size);
  const std::string_view asf = text.substr(0, cut);
  const std::string_view amc = text.substr(std::min(cut + 2, size));
  const auto clip = posed::clip::parse_amc(amc, "fuzz.amc", asf, "fuzz.asf");
  if (clip) posed::test::check_clip(*clip);
  return 0;
}
