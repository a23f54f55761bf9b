// One opened device of each kind that posed drives: what the tests of tests/unit/drivers run on. A
// new driver adds its fixture here and is then held to all that drivers promise.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::test {

using Bytes = std::vector<std::byte>;

struct DeviceFixture {
  std::string name;
  std::string driver;
  drivers::Options options;      // of a looped stream
  std::size_t loop_chunks = 0;   // after which the input repeats
  std::size_t chunk_frames = 0;  // a chunk gives
  std::size_t chunk_samples = 0;
  std::size_t chunk_packets = 1;
  bool emulated = false;       // its driver's emulator stands for the device (emulated.hpp)
  bool whole_reports = false;  // over USB: a packet comes whole or not at all
  std::string start{};         // what the emulator has to hear before it streams
};

// Makes the clips they play in a folder of its own, removed at exit.
[[nodiscard]] const std::vector<DeviceFixture>& device_fixtures();

[[nodiscard]] drivers::Device open_device(const DeviceFixture& fixture);
[[nodiscard]] std::vector<Bytes> read_chunks(drivers::Transport& transport, std::size_t count);

// A file of this text in that folder.
[[nodiscard]] std::filesystem::path scratch_file(const std::string& name, const std::string& text);

// Small clips, whole: five frames each.
[[nodiscard]] std::string small_bvh();
[[nodiscard]] std::string small_asf();
[[nodiscard]] std::string small_amc();
// A hand at 50 Hz, every angle another.
[[nodiscard]] std::string small_hand_csv();

}  // namespace posed::test
