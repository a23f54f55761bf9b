// A driver's decoder without a device, also with what it makes of bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "drivers/driver.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {

inline std::unique_ptr<drivers::Decoder> decoder_of(const drivers::Driver& driver,
                                                    const drivers::Options& options = {}) {
  const auto description = driver.expect(options);
  if (!description) FAIL(description.error().text());
  auto decoder = driver.make_decoder(*description);
  if (!decoder) FAIL(decoder.error().text());
  return std::move(*decoder);
}

// A decoder that uses each description at once, as the daemon does a little later.
struct DecoderRig {
  explicit DecoderRig(std::string_view name, const drivers::Options& options = {})
      : driver(*drivers::find_driver(name)), decoder(decoder_of(driver, options)) {}

  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns = 0) {
    const int before = sink.descriptions;
    decoder->feed(bytes, arrival_ns, sink);
    if (sink.descriptions != before) use(sink.described);
  }
  void use(std::span<const std::byte> description) {
    auto layout = driver.make_layout(description);
    if (!layout) FAIL(layout.error().text());
    layouts.push_back(std::move(*layout));
    decoder->use(*layouts.back());
  }
  [[nodiscard]] const std::vector<drivers::Body>& bodies() const { return layouts.back()->bodies; }

  const drivers::Driver& driver;
  std::unique_ptr<drivers::Decoder> decoder;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts;
  CollectSink sink;
};

}  // namespace posed::test
