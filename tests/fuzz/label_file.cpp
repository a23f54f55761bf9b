// parse_labels on any text: an error or ordered segments, never a crash.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "proto/clip/label_file.hpp"
#include "proto/frame/label.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto labels = posed::clip::parse_labels(text, "fuzz.lab", 1000.0);
  if (!labels) return 0;
  double end_s = 0.0;
  for (const auto& segment : *labels) {
    const bool in_order = segment.start_s >= end_s - 1e-5 && segment.end_s > segment.start_s;
    if (!in_order || !posed::is_label_name(segment.name)) std::abort();
    end_s = segment.end_s;
  }
  return 0;
}
