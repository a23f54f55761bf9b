// One opened device of each kind that posed supports, for the tests in tests/unit/drivers, which
// hold it to all properties that drivers must have. A glove of the registry that streams from
// power-on is found there; any other new device adds its fixture to the .cpp.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::test {

using Bytes = std::vector<std::byte>;

struct DeviceFixture {
  std::string name;
  std::string driver;
  drivers::Options options;      // options of a stream that loops
  std::size_t loop_chunks = 0;   // after which the input repeats
  std::size_t chunk_frames = 0;  // frames that a chunk gives
  std::size_t chunk_samples = 0;
  std::size_t chunk_packets = 1;
  bool emulated = false;       // its driver's emulator replaces the device (emulated.hpp)
  bool whole_reports = false;  // over USB: a packet arrives complete or not at all
  bool datagrams = false;      // over UDP: a chunk is a packet, complete or not
  std::string start{};         // bytes that the emulator needs before it streams
};

// Writes the clips that they play into a folder that is removed at exit.
[[nodiscard]] const std::vector<DeviceFixture>& device_fixtures();

[[nodiscard]] drivers::Device open_device(const DeviceFixture& fixture);
// The bodies of a device with several; null for others.
[[nodiscard]] const drivers::SourceLayout* layout_of(const DeviceFixture& fixture);
// A decoder for the same device, with the same bodies.
[[nodiscard]] std::unique_ptr<drivers::Decoder> new_decoder(
    const DeviceFixture& fixture, const drivers::Description& description);
[[nodiscard]] std::vector<Bytes> read_chunks(drivers::Transport& transport, std::size_t count);

// Writes a file with this text into that folder.
[[nodiscard]] std::filesystem::path scratch_file(const std::string& name, const std::string& text);

// The texts of small clips of five frames each.
[[nodiscard]] std::string small_bvh();
[[nodiscard]] std::string small_asf();
[[nodiscard]] std::string small_amc();
// A hand at 50 Hz, all angles different.
[[nodiscard]] std::string small_hand_csv();

}  // namespace posed::test
