// For the tests of the VMC driver: single messages, bundles made by hand, a frame's datagrams from
// the emulator, and a session that uses descriptions at once.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/byte_writer.hpp"
#include "drivers/vmc/emulator.hpp"
#include "drivers/vmc/messages.hpp"
#include "tests/unit/drivers/decoder_of.hpp"

namespace posed::test {

using Bytes = std::vector<std::byte>;

inline Bytes bytes_of(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

// The bytes of the one message that `write` adds.
template <typename Write>
Bytes vmc_message(Write&& write) {
  drivers::vmc::DatagramWriter writer(drivers::vmc::Packing::kMessages);
  writer.start();
  write(writer);
  return bytes_of(writer.datagram(0));
}

inline Bytes bundle_of(const std::vector<Bytes>& elements) {
  drivers::BigEndianWriter writer;
  writer.text("#bundle");
  writer.u8(0);
  writer.u64(1);
  for (const Bytes& element : elements) {
    writer.u32(static_cast<std::uint32_t>(element.size()));
    writer.bytes(element);
  }
  return writer.finish();
}

// A message with any text, numbers and whole numbers, so also a wrong one.
inline Bytes raw_message(const std::string& address, const std::string& types,
                         const std::string& text, const std::vector<float>& numbers) {
  drivers::BigEndianWriter writer;
  const auto padded = [&writer](const std::string& value) {
    writer.text(value);
    for (std::size_t i = value.size(); i < (value.size() + 4) / 4 * 4; ++i) writer.u8(0);
  };
  padded(address);
  padded("," + types);
  if (types.starts_with('s')) padded(text);
  for (const float number : numbers) writer.f32(number);
  return writer.finish();
}

inline Bytes raw_bone(const std::string& name, const std::vector<float>& numbers) {
  return raw_message("/VMC/Ext/Bone/Pos", "s" + std::string(numbers.size(), 'f'), name, numbers);
}

// The datagrams of the emulator's next frame.
inline std::vector<Bytes> vmc_burst(drivers::vmc::VmcEmulator& emulator) {
  std::vector<Bytes> datagrams;
  const std::int64_t due_ns = emulator.next_due_ns();
  while (emulator.next_due_ns() == due_ns) emulator.emit(due_ns, datagrams.emplace_back());
  return datagrams;
}

struct VmcSession : DecoderRig {
  VmcSession() : DecoderRig("vmc") {}

  using DecoderRig::feed;
  // One after the other, in steps of 50 us.
  void feed(const std::vector<Bytes>& burst, std::int64_t first_ns) {
    for (std::size_t i = 0; i < burst.size(); ++i) {
      feed(burst[i], first_ns + 50'000 * static_cast<std::int64_t>(i));
    }
  }
  [[nodiscard]] const drivers::Body& body() const { return bodies().front(); }
};

}  // namespace posed::test
