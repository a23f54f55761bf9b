// What the fuzz targets of decoders share.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "drivers/driver.hpp"
#include "tests/fuzz/demand.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::fuzz {

// Feeds a decoder and counts it. One execution of a target may feed many datagrams, so their number
// is printed when the process ends.
inline void feed(drivers::Decoder& decoder, std::span<const std::byte> bytes,
                 std::int64_t arrival_ns, Sink& sink) {
  struct Count {
    ~Count() { std::fprintf(stderr, "decoder inputs: %llu\n", inputs); }
    unsigned long long inputs = 0;
  };
  static Count count;
  ++count.inputs;
  decoder.feed(bytes, arrival_ns, sink);
}

// What a decoder emits has rotations of length 1 and finite numbers.
inline void demand_valid(const test::CollectSink& sink) {
  for (const Frame& frame : sink.frames) demand(test::is_valid(frame));
  for (const Sample& sample : sink.samples) demand(test::is_valid(sample));
}

// Who wrote the descriptions that a decoder emits: one that writes them itself writes sound ones,
// one that hands the sender's bytes on leaves it to make_layout to refuse them.
enum class DescriptionsOf : std::uint8_t { kDecoder, kSender };

// A decoder that uses each of its descriptions at once.
class Session {
 public:
  Session(const drivers::Driver& driver, const drivers::Description& description,
          DescriptionsOf author = DescriptionsOf::kDecoder)
      : driver_(driver), decoder_(driver.make_decoder(description).value()), author_(author) {}

  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns) {
    const int before = sink.descriptions;
    fuzz::feed(*decoder_, bytes, arrival_ns, sink);
    demand_valid(sink);
    for (const std::size_t body : sink.bodies) demand(body < layouts_.back()->bodies.size());
    sink.frames.clear();
    sink.bodies.clear();
    sink.samples.clear();
    sink.sample_bodies.clear();
    if (sink.descriptions == before) return;
    auto layout = driver_.make_layout(sink.described);
    demand(layout.has_value() || author_ == DescriptionsOf::kSender);
    if (!layout) return;
    demand((*layout)->bodies.size() <= kMaxBodies);
    decoder_->use(**layout);
    layouts_.push_back(std::move(*layout));
  }

  test::CollectSink sink{0};

 private:
  const drivers::Driver& driver_;
  std::unique_ptr<drivers::Decoder> decoder_;
  DescriptionsOf author_;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts_;
};

// The datagrams of an emulator, one a call of `emit`.
template <class Emulator>
std::vector<std::vector<std::byte>> emulated_datagrams(Emulator&& emulator, std::size_t count) {
  std::vector<std::vector<std::byte>> datagrams(count);
  for (auto& datagram : datagrams) emulator.emit(emulator.next_due_ns(), datagram);
  return datagrams;
}

// Feeds the first good datagrams, then the pieces of the input, each beside a good datagram that
// has the piece laid over its bytes. Each piece begins with two bytes: its length / 4, and the time
// since the one before in milliseconds, which also says where it is laid. Returns how many
// datagrams were fed.
inline int feed_pieces(Session& session, const std::vector<std::vector<std::byte>>& good,
                       std::span<const std::byte> input) {
  constexpr int kFirst = 4;
  constexpr int kMaxPieces = 100;
  std::int64_t now_ns = 0;
  std::size_t next = 0;
  while (next < kFirst) session.feed(good[next++], now_ns);
  int pieces = 0;
  for (; input.size() >= 2 && pieces < kMaxPieces; ++pieces) {
    const std::size_t length =
        std::min(input.size() - 2, 4 * std::to_integer<std::size_t>(input[0]));
    const auto at = 17 * std::to_integer<std::size_t>(input[1]);
    now_ns += std::to_integer<std::int64_t>(input[1]) * 1'000'000;
    const auto piece = input.subspan(2, length);
    input = input.subspan(2 + length);
    session.feed(piece, now_ns);
    std::vector<std::byte> changed = good[next++ % good.size()];
    for (std::size_t i = 0; i < piece.size() && at + i < changed.size(); ++i) {
      changed[at + i] ^= piece[i];
    }
    session.feed(changed, now_ns);
  }
  return kFirst + 2 * pieces;
}

}  // namespace posed::fuzz
