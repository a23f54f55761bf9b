// Rokoko Studio's decoder on any datagrams, beside good ones that change, as JSON of each version
// and in LZ4; it describes what it has seen, and each description becomes a layout that it uses.
// Then any bytes as a description.
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "tests/fuzz/session.hpp"

namespace {

// Datagrams of a stream that changes its version now and then. Those with Anna, her gloves and her
// face are long, so they are few.
std::vector<std::vector<std::byte>> studio_datagrams() {
  using posed::drivers::rokoko::StudioEmulator;
  using posed::drivers::rokoko::StudioVersion;
  constexpr std::size_t kShort = 8;
  std::vector<std::vector<std::byte>> all;
  for (const auto version : {StudioVersion::k3, StudioVersion::k25, StudioVersion::k2}) {
    for (const bool lz4 : {false, true}) {
      StudioEmulator studio({.rate_hz = 60.0, .version = version, .lz4 = lz4});
      for (const bool anna : {true, false}) {
        studio.set_present(0, anna);
        auto some = posed::fuzz::emulated_datagrams(studio, anna ? 1 : kShort);
        for (auto& datagram : some) all.push_back(std::move(datagram));
      }
    }
  }
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::find_driver;
  static const auto good = studio_datagrams();
  const std::span bytes = std::as_bytes(std::span(data, size));
  posed::fuzz::Session session(*find_driver("rokoko"), find_driver("rokoko")->expect({}).value());
  posed::fuzz::feed_pieces(session, good, bytes);
  (void)find_driver("rokoko")->make_layout(bytes);
  return 0;
}
