// The decoder of MVN on any datagrams and any TCP stream, with two characters known to it, who have
// sent all that fits into samples. The first byte says how the rest is cut into datagrams, each of
// which also gets a right head.
#include <algorithm>
#include <cstdint>

#include "drivers/mvn/decoder.hpp"
#include "drivers/mvn/emulator.hpp"
#include "drivers/mvn/encode.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::SourceLayout;
using posed::drivers::mvn::Head;
using posed::drivers::mvn::MvnDecoder;
using posed::drivers::mvn::ValueGroup;
using posed::fuzz::demand;
using posed::fuzz::feed;
using posed::test::CollectSink;

const SourceLayout& two_characters() {
  static const auto layout = [] {
    std::vector<std::byte> bytes(posed::drivers::mvn::kMaxMvnDescription);
    const std::span all(bytes);
    std::size_t used = posed::drivers::mvn::write_description_head(2, all);
    auto walker = posed::drivers::mvn::emulated_walker();
    auto waver = posed::drivers::mvn::emulated_waver();
    walker.values.set();
    waver.values.set(static_cast<std::size_t>(ValueGroup::kLongTrackers));
    for (const auto& character : {walker, waver}) {
      used += posed::drivers::mvn::write_character(character, all.subspan(used));
    }
    return posed::drivers::mvn::make_layout(all.first(used)).value();
  }();
  return *layout;
}

void check(const CollectSink& sink) {
  for (const std::size_t body : sink.bodies) demand(body < two_characters().bodies.size());
  posed::fuzz::demand_valid(sink);
  if (sink.descriptions > 0) demand(posed::drivers::mvn::make_layout(sink.described).has_value());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t piece = std::size_t{16} * (1U + data[0]);
  const std::span bytes = std::as_bytes(std::span(data + 1, size - 1));
  MvnDecoder datagrams(false);
  MvnDecoder stream(true);
  datagrams.use(two_characters());
  stream.use(two_characters());
  CollectSink sink(0);
  std::int64_t now_ns = 0;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto part = bytes.subspan(at, std::min(piece, bytes.size() - at));
    now_ns += 200'000'000;
    feed(datagrams, part, now_ns, sink);
    feed(stream, part, now_ns, sink);
    Head head;
    std::vector<std::byte> framed(posed::drivers::mvn::kHeadBytes);
    std::ranges::copy(part.first(std::min(part.size(), framed.size())), framed.begin());
    std::ranges::copy(std::as_bytes(std::span("MXTP", 4)), framed.begin());
    if (!posed::drivers::mvn::read_head(framed, head)) continue;
    const auto whole = encode_datagram(head, part.subspan(std::min(part.size(), framed.size())));
    feed(datagrams, whole, now_ns, sink);
    feed(stream, whole, now_ns, sink);
  }
  check(sink);
  const auto any = posed::drivers::mvn::make_layout(bytes);
  if (any) datagrams.use(**any);
  return 0;
}
