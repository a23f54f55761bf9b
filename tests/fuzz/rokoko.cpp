// Rokoko Studio's decoder on any datagrams: JSON and LZ4 frames, with its own descriptions in use,
// and any bytes as a description. The first byte says how the rest is cut into datagrams.
#include <algorithm>
#include <cstdint>
#include <span>

#include "drivers/rokoko/rokoko.hpp"
#include "tests/fuzz/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::rokoko_driver;
  if (size < 1) return 0;
  std::span bytes = std::as_bytes(std::span(data + 1, size - 1));
  (void)rokoko_driver().make_layout(bytes);
  const std::size_t piece = bytes.size() / (1U + data[0] % 4U) + 1;
  posed::fuzz::Session session(rokoko_driver(), rokoko_driver().expect({}).value());
  for (std::int64_t arrival_ns = 0; !bytes.empty(); arrival_ns += 600'000'000) {
    const std::size_t length = std::min(piece, bytes.size());
    session.feed(bytes.first(length), arrival_ns);
    bytes = bytes.subspan(length);
  }
  return 0;
}
