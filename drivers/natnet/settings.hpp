// What a NatNet decoder must know beside the bytes: the device info in Description::text.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/natnet/protocol.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::natnet {

// In which frame the server streams the bones of skeletons; kAuto: found out from each skeleton.
enum class Coordinates : std::uint8_t { kAuto, kLocal, kGlobal };

struct Settings {
  Version version;  // unknown: as the server says
  bool z_up = false;
  Coordinates coordinates = Coordinates::kAuto;
  bool unicast = false;
  int rate_hz = 120;  // until the server says it
};

// "natnet version=auto up=y coordinates=auto cast=multi rate=120", and back. Cold.
[[nodiscard]] std::string settings_text(const Settings& settings);
[[nodiscard]] Result<Settings> parse_settings(const std::string& text, const std::string& identity);

// The words of the options.
[[nodiscard]] Result<bool> parse_up(const std::string& word);
[[nodiscard]] Result<Coordinates> parse_coordinates(const std::string& word);

}  // namespace posed::drivers::natnet
