// The decoder of a hand tracker's messages on any datagrams at any times, beside good ones that
// change; then any bytes as a description.
#include <cstdint>
#include <span>

#include "drivers/driver.hpp"
#include "drivers/landmarks/emulator.hpp"
#include "tests/fuzz/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::find_driver;
  using posed::drivers::landmarks::LandmarksEmulator;
  static const auto good = posed::fuzz::emulated_datagrams(LandmarksEmulator(10.0), 64);
  const std::span bytes = std::as_bytes(std::span(data, size));
  const auto& driver = *find_driver("landmarks");
  posed::fuzz::Session session(driver, driver.expect({}).value());
  const int fed = posed::fuzz::feed_pieces(session, good, bytes);
  int counted = 0;
  for (const int count : session.sink.outcomes) counted += count;
  posed::fuzz::demand(counted == fed);
  (void)driver.make_layout(bytes);
  return 0;
}
