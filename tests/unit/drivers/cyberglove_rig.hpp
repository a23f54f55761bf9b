// Emulators and decoders of a CyberGlove for its tests.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

#include <catch2/catch.hpp>

#include "drivers/cyberglove/emulator.hpp"
#include "drivers/cyberglove/start.hpp"
#include "drivers/driver.hpp"

namespace posed::drivers::cyberglove {

using Raw = std::array<double, kSensors>;

inline std::unique_ptr<Decoder> decoder_of(const RequestedConfig& glove) {
  const auto description = find_driver("cyberglove")->describe(device_info_of(glove), "test");
  if (!description) FAIL(description.error().text());
  auto decoder = find_driver("cyberglove")->make_decoder(*description);
  if (!decoder) FAIL(decoder.error().text());
  return std::move(*decoder);
}

inline std::unique_ptr<CyberGloveEmulator> emulator_of(EmulatorSettings settings) {
  auto emulator = CyberGloveEmulator::make(std::move(settings));
  if (!emulator) FAIL(emulator.error().text());
  return std::move(*emulator);
}

inline Emulator::Bytes notify(Emulator& emulator, std::string_view text) {
  Emulator::Bytes answer;
  emulator.receive(std::as_bytes(std::span(text)), 0, answer);
  return answer;
}

inline std::string text_of(const Emulator::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline Emulator::Bytes next(Emulator& emulator) {
  Emulator::Bytes bytes;
  emulator.emit(emulator.next_due_ns(), bytes);
  return bytes;
}

// Sensor counts in the middle of a hand's range, all different.
inline Raw some_raw() {
  Raw raw{};
  for (std::size_t i = 0; i < kSensors; ++i) raw[i] = 60.0 + 5.0 * static_cast<double>(i);
  raw[kThumbMcp] = 'S';
  return raw;
}

inline constexpr Layout kPlain22{.mask = kMask22, .time = false, .status = false};

inline std::string plain_start() { return std::string("U\0D\0S", 5); }

}  // namespace posed::drivers::cyberglove
