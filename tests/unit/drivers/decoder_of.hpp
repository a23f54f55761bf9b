// A driver's decoder without a device.
#pragma once

#include <memory>
#include <utility>

#include <catch2/catch.hpp>

#include "drivers/driver.hpp"

namespace posed::test {

inline std::unique_ptr<drivers::Decoder> decoder_of(const drivers::Driver& driver,
                                                    const drivers::Options& options = {}) {
  const auto description = driver.expect(options);
  if (!description) FAIL(description.error().text());
  auto decoder = driver.make_decoder(*description);
  if (!decoder) FAIL(decoder.error().text());
  return std::move(*decoder);
}

}  // namespace posed::test
