// The VMC decoder on any datagrams at any times, beside good ones that change: it describes what it
// has seen, and each description becomes a layout that it uses. Each piece of the input begins with
// two bytes: its length / 4, and the time since the one before in milliseconds.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "drivers/vmc/emulator.hpp"
#include "drivers/vmc/vmc.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::Decoder;
using posed::drivers::SourceLayout;
using posed::drivers::vmc_driver;

void demand(bool holds) {
  if (!holds) std::abort();
}

struct Session {
  std::unique_ptr<Decoder> decoder =
      vmc_driver().make_decoder(vmc_driver().expect({}).value()).value();
  std::vector<std::unique_ptr<const SourceLayout>> layouts;
  posed::test::CollectSink sink{0};
  int outcomes = 0;

  void feed(std::span<const std::byte> datagram, std::int64_t now_ns) {
    const int before = sink.descriptions;
    decoder->feed(datagram, now_ns, sink);
    ++outcomes;
    if (sink.descriptions == before) return;
    auto layout = vmc_driver().make_layout(sink.described);
    demand(layout.has_value());  // it wrote the description itself
    decoder->use(**layout);
    layouts.push_back(std::move(*layout));
  }
  void check() const {
    int counted = 0;
    for (const int count : sink.outcomes) counted += count;
    demand(counted == outcomes);
    for (const posed::Frame& frame : sink.frames) demand(posed::test::is_sound(frame));
    for (const posed::Sample& sample : sink.samples) demand(posed::test::is_sound(sample));
  }
};

// Good datagrams, one a frame.
const std::vector<std::vector<std::byte>>& good_datagrams() {
  static const auto made = [] {
    posed::drivers::vmc::VmcEmulator emulator(60.0, posed::drivers::vmc::Packing::kOneBundle);
    std::vector<std::vector<std::byte>> datagrams(64);
    for (auto& datagram : datagrams) emulator.emit(emulator.next_due_ns(), datagram);
    return datagrams;
  }();
  return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span input = std::as_bytes(std::span(data, size));
  const auto& good = good_datagrams();
  Session session;
  std::int64_t now_ns = 0;
  std::size_t next = 0;
  while (next < 4) session.feed(good[next++], now_ns);
  for (int pieces = 0; input.size() >= 2 && pieces < 100; ++pieces) {
    const std::size_t length =
        std::min(input.size() - 2, 4 * std::to_integer<std::size_t>(input[0]));
    const auto at = 17 * std::to_integer<std::size_t>(input[1]);
    now_ns += std::to_integer<std::int64_t>(input[1]) * 1'000'000;
    const auto piece = input.subspan(2, length);
    input = input.subspan(2 + length);
    session.feed(piece, now_ns);
    // A good datagram with the piece laid over its bytes from `at` on.
    std::vector<std::byte> changed = good[next++ % good.size()];
    for (std::size_t i = 0; i < piece.size() && at + i < changed.size(); ++i) {
      changed[at + i] ^= piece[i];
    }
    session.feed(changed, now_ns);
  }
  session.check();
  (void)vmc_driver().make_layout(std::as_bytes(std::span(data, size)));
  return 0;
}
