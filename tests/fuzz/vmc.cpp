// The VMC decoder on any datagrams at any times, beside good ones that change: it describes what it
// has seen, and each description becomes a layout that it uses.
#include <cstdint>
#include <span>

#include "drivers/driver.hpp"
#include "drivers/vmc/emulator.hpp"
#include "tests/fuzz/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::find_driver;
  using posed::drivers::vmc::VmcEmulator;
  static const auto good = posed::fuzz::emulated_datagrams(
      VmcEmulator(60.0, posed::drivers::vmc::Packing::kOneBundle), 64);
  const std::span bytes = std::as_bytes(std::span(data, size));
  posed::fuzz::Session session(*find_driver("vmc"), find_driver("vmc")->expect({}).value());
  const int fed = posed::fuzz::feed_pieces(session, good, bytes);
  int counted = 0;
  for (const int count : session.sink.outcomes) counted += count;
  posed::fuzz::demand(counted == fed);
  (void)find_driver("vmc")->make_layout(bytes);
  return 0;
}
