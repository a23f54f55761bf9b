// The mocopi decoder on any datagrams, beside good skeletons and frames that change, and any bytes
// as a description.
#include <cstdint>
#include <span>

#include "drivers/mocopi/emulator.hpp"
#include "drivers/mocopi/mocopi.hpp"
#include "tests/fuzz/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using posed::drivers::mocopi_driver;
  static const auto good =
      posed::fuzz::emulated_datagrams(posed::drivers::mocopi::MocopiEmulator(60.0), 64);
  const std::span bytes = std::as_bytes(std::span(data, size));
  posed::fuzz::Session session(mocopi_driver(), mocopi_driver().expect({}).value(),
                               posed::fuzz::DescriptionsOf::kSender);
  posed::fuzz::feed_pieces(session, good, bytes);
  (void)mocopi_driver().make_layout(bytes);
  return 0;
}
