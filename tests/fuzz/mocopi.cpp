// The mocopi decoder on any datagrams, beside good skeletons and frames that change, and any bytes
// as a description.
#include <cstdint>
#include <span>

#include "drivers/driver.hpp"
#include "drivers/mocopi/emulator.hpp"
#include "tests/fuzz/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::find_driver;
  static const auto good =
      posed::fuzz::emulated_datagrams(posed::drivers::mocopi::MocopiEmulator(60.0), 64);
  const std::span bytes = std::as_bytes(std::span(data, size));
  posed::fuzz::Session session(*find_driver("mocopi"), find_driver("mocopi")->expect({}).value(),
                               posed::fuzz::DescriptionsOf::kSender);
  posed::fuzz::feed_pieces(session, good, bytes);
  (void)find_driver("mocopi")->make_layout(bytes);
  return 0;
}
