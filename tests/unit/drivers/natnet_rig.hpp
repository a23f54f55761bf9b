// A NatNet decoder that gets datagrams and uses each description at once, as the daemon does a
// little later.
#pragma once

#include <catch2/catch.hpp>

#include <span>
#include <vector>

#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/layout.hpp"
#include "tests/unit/drivers/decoder_of.hpp"

namespace posed::test {

using NatNetBytes = std::vector<std::byte>;

struct NatNetRig : DecoderRig {
  explicit NatNetRig(const drivers::Options& options = {}) : DecoderRig("natnet", options) {}

  // Returns the outcome.
  Outcome feed(std::span<const std::byte> datagram, std::int64_t arrival_ns = 0) {
    const auto before = sink.outcomes;
    DecoderRig::feed(datagram, arrival_ns);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (sink.outcomes[i] != before[i]) return static_cast<Outcome>(i);
    }
    FAIL("no outcome");
    return Outcome::kCount;
  }
  [[nodiscard]] const drivers::SourceLayout& layout() const { return *layouts.back(); }
};

}  // namespace posed::test
