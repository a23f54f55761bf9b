// Every glove's decoder on any bytes, and on its own packets with any bytes in them. A decoder is
// kept from input to input, as on a serial line, so that millions of inputs are cheap (`decoders`
// creates a new one for each). A finding may therefore depend on earlier inputs: run again with the
// same -seed.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "tests/fuzz/glove_kinds.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::Driver;
using posed::drivers::Options;
using posed::fuzz::demand;
using posed::fuzz::feed;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kRecords = 2;

class ValidSink final : public posed::Sink {
 public:
  void frame(std::size_t /*body*/, posed::Frame& frame) noexcept override {
    demand(posed::test::is_valid(frame));
  }
  void sample(std::size_t /*body*/, posed::Sample& sample) noexcept override {
    demand(posed::test::is_valid(sample));
  }
  void outcome(posed::Outcome /*outcome*/) noexcept override {}
};

struct Glove {
  std::unique_ptr<posed::drivers::Decoder> decoder;
  Bytes records;  // as its emulator sends them; empty if the emulator waits for a start command
};

Glove make_glove(const Driver& driver, const Options& options) {
  const auto description = driver.expect(options);
  demand(description.has_value());
  auto decoder = driver.make_decoder(*description);
  auto emulator = driver.emulate(options);
  demand(decoder.has_value() && emulator.has_value());
  Glove glove{std::move(*decoder), {}};
  for (std::size_t i = 0; i < kRecords; ++i) {
    const std::int64_t due_ns = (*emulator)->next_due_ns();
    if (due_ns != posed::kNoTime_ns) (*emulator)->emit(due_ns, glove.records);
  }
  return glove;
}

std::vector<Glove> make_gloves() {
  std::vector<Glove> gloves;
  for (const auto& [driver, options] : posed::fuzz::glove_kinds()) {
    gloves.push_back(make_glove(*driver, options));
  }
  return gloves;
}

// `edits` has pairs of a position and the byte to put there.
Bytes edited(const Bytes& records, std::span<const std::byte> edits) {
  Bytes bytes = records;
  for (; edits.size() >= 2 && !bytes.empty(); edits = edits.subspan(2)) {
    bytes[std::to_integer<std::size_t>(edits[0]) * 3 % bytes.size()] = edits[1];
  }
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::vector<Glove> gloves = make_gloves();
  const auto bytes = std::as_bytes(std::span(data, size));
  ValidSink sink;
  for (Glove& glove : gloves) {
    feed(*glove.decoder, bytes, 0, sink);
    feed(*glove.decoder, edited(glove.records, bytes), 0, sink);
  }
  return 0;
}
