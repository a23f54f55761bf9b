// A NatNet decoder that gets datagrams and uses each description at once, as the daemon does a
// little later.
#pragma once

#include <catch2/catch.hpp>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/layout.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

using NatNetBytes = std::vector<std::byte>;

struct NatNetRig {
  explicit NatNetRig(const drivers::Options& options = {}) {
    const drivers::Driver& driver = *drivers::find_driver("natnet");
    auto description = driver.expect(options);
    if (!description) FAIL(description.error().text());
    decoder = driver.make_decoder(*description).value();
  }

  // Returns the outcome.
  Outcome feed(std::span<const std::byte> datagram, std::int64_t arrival_ns = 0) {
    const auto before = sink.outcomes;
    const int descriptions = sink.descriptions;
    decoder->feed(datagram, arrival_ns, sink);
    if (sink.descriptions != descriptions) use(sink.described);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (sink.outcomes[i] != before[i]) return static_cast<Outcome>(i);
    }
    FAIL("no outcome");
    return Outcome::kCount;
  }
  void use(std::span<const std::byte> description) {
    auto layout = drivers::find_driver("natnet")->make_layout(description);
    if (!layout) FAIL(layout.error().text());
    layouts.push_back(std::move(*layout));
    decoder->use(*layouts.back());
  }
  [[nodiscard]] const drivers::SourceLayout& layout() const { return *layouts.back(); }

  std::unique_ptr<drivers::Decoder> decoder;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts;
  CollectSink sink;
};

}  // namespace posed::test
