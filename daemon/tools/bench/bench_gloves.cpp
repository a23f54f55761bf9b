#include "daemon/tools/bench/bench_gloves.hpp"

#include <cmath>
#include <numbers>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::tools {
namespace {

using drivers::Driver;
using drivers::Emulator;
using drivers::Options;

// Lends an emulator to code that wants to own one.
class LentEmulator final : public Emulator {
 public:
  explicit LentEmulator(Emulator& emulator) : emulator_(emulator) {}
  void pose(std::size_t body, const Frame& frame) override { emulator_.pose(body, frame); }
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override {
    emulator_.receive(bytes, now_ns, answer);
  }
  [[nodiscard]] std::int64_t next_due_ns() const override { return emulator_.next_due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override { emulator_.emit(now_ns, out); }

 private:
  Emulator& emulator_;
};

// The driver opens the emulator as it would open the glove; afterwards the emulator streams.
Result<std::unique_ptr<drivers::Decoder>> opened_decoder(const Driver& driver, Options options,
                                                         Emulator& emulator) {
  auto port = emulate::EmulatedPort::open_pty();
  if (!port) return std::unexpected(port.error());
  options["port"] = port->name();
  emulate::EmulatedDevice glove(std::make_unique<LentEmulator>(emulator), std::move(*port), {}, {});
  const std::jthread thread([&](const std::stop_token& stop) { glove.run(stop); });
  drivers::TransportFactory ports;
  auto device = driver.open(options, ports);
  if (!device) return std::unexpected(device.error());
  return std::move(device->decoder);
}

Result<std::unique_ptr<drivers::Decoder>> expected_decoder(const Driver& driver,
                                                           const Options& options) {
  const auto description = driver.expect(options);
  if (!description) return std::unexpected(description.error());
  return driver.make_decoder(*description);
}

Result<BenchGlove> make_bench_glove(const Driver& driver, const std::string& name,
                                    const Options& options) {
  auto emulator = driver.emulate(options);
  if (!emulator) return std::unexpected(emulator.error());
  auto decoder = (*emulator)->next_due_ns() == kNoTime_ns
                     ? opened_decoder(driver, options, **emulator)
                     : expected_decoder(driver, options);
  if (!decoder) return std::unexpected(decoder.error());
  return BenchGlove{name, std::move(*emulator), std::move(*decoder)};
}

// The variants of a driver's gloves that differ in their bytes.
std::vector<std::pair<std::string, Options>> glove_kinds(const Driver& driver) {
  const std::string name(driver.name);
  std::vector<std::pair<std::string, Options>> found;
  if (name != "described") found.push_back({name, {}});
  if (name == "cyberglove") found.push_back({name + " 16bit", {{"form", std::string("16bit")}}});
  if (name == "fivedt") found.push_back({name + " 16", {{"model", std::string("16")}}});
  if (name == "lucidgloves") {
    found.push_back({name + " legacy", {{"encoding", std::string("legacy")}}});
  }
  if (name != "described") return found;
  for (const std::string& device : drivers::described::shipped_devices()) {
    found.push_back({fmt::format("{} {}", name, device), {{"device", device}}});
  }
  return found;
}

}  // namespace

Result<std::vector<BenchGlove>> bench_gloves() {
  std::vector<BenchGlove> gloves;
  for (const Driver& driver : drivers::registry()) {
    if (driver.glove == nullptr || driver.emulate == nullptr) continue;
    for (const auto& [name, options] : glove_kinds(driver)) {
      auto glove = make_bench_glove(driver, name, options);
      if (!glove) return std::unexpected(glove.error());
      gloves.push_back(std::move(*glove));
    }
  }
  return gloves;
}

void next_record(BenchGlove& glove, std::size_t index, std::vector<std::byte>& out) {
  constexpr double kRecordsATurn = 64.0;
  HandAngles angles{};
  const double turn = 2.0 * std::numbers::pi * static_cast<double>(index) / kRecordsATurn;
  for (std::size_t i = 0; i < angles.size(); i += 3) angles[i] = 0.5 - 0.5 * std::cos(turn);
  glove.emulator->pose(0, drivers::glove::hand_frame(angles));
  glove.emulator->emit(glove.emulator->next_due_ns(), out);
}

}  // namespace posed::tools
