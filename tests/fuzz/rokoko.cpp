// Rokoko Studio's decoder on any datagrams: JSON and LZ4 frames, with its own descriptions in use,
// and any bytes as a description. The first byte says how the rest is cut into datagrams.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "drivers/rokoko/decoder.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::test::CollectSink;

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  std::span bytes = std::as_bytes(std::span(data + 1, size - 1));
  static_cast<void>(posed::drivers::rokoko::make_layout(bytes));
  const std::size_t piece = bytes.size() / (1U + data[0] % 4U) + 1;
  posed::drivers::rokoko::StudioDecoder decoder;
  std::vector<std::unique_ptr<const posed::drivers::SourceLayout>> layouts;
  CollectSink sink(0);
  for (std::int64_t arrival_ns = 0; !bytes.empty(); arrival_ns += 600'000'000) {
    const std::size_t length = std::min(piece, bytes.size());
    const int before = sink.descriptions;
    decoder.feed(bytes.first(length), arrival_ns, sink);
    bytes = bytes.subspan(length);
    if (sink.descriptions == before) continue;
    auto layout = posed::drivers::rokoko::make_layout(sink.described);
    demand(layout.has_value());  // what the decoder describes can be built
    demand((*layout)->bodies.size() <= posed::kMaxBodies);
    decoder.use(**layout);
    layouts.push_back(std::move(*layout));
  }
  for (const posed::Frame& frame : sink.frames) demand(posed::test::is_sound(frame));
  for (const posed::Sample& sample : sink.samples) demand(posed::test::is_sound(sample));
  return 0;
}
