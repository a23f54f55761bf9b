// The gloves that these tests plug in.
#pragma once

#include <fstream>
#include <iterator>
#include <string>

#include <catch2/catch.hpp>

#include "tests/support/shared.hpp"
#include "tests/usb/bench.hpp"

namespace posed::test {

inline const UsbIds kUltra{.vendor = 0x5D70,
                           .product = 0x0001,
                           .serial = "ULTRA-7",
                           .maker = "5DT",
                           .product_name = "5DT Data Glove Ultra",
                           .port = 2};
inline const UsbIds kP5{.vendor = 0x0D7F,
                        .product = 0x0100,
                        .serial = "",
                        .maker = "Essential Reality",
                        .product_name = "P5 Virtual Reality",
                        .port = 3};
// The glove of the example description in a README.
inline const UsbIds kMine{.vendor = 0x1234,
                          .product = 0xABCD,
                          .serial = "MINE-1",
                          .maker = "",
                          .product_name = "Mine",
                          .port = 4};

inline std::string readme_description() {
  std::ifstream file(source_dir() / "drivers/described/README.md");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto begin = text.find("name = \"mine\"");
  const auto end = text.find("```", begin);
  REQUIRE(end != std::string::npos);
  return text.substr(begin, end - begin);
}

}  // namespace posed::test
