#include "daemon/tools/emulate/synthetic_signer.hpp"

#include "drivers/driver.hpp"
#include "drivers/options.hpp"

namespace posed::emulate {

Result<std::unique_ptr<SyntheticSigner>> SyntheticSigner::start(const std::string& name,
                                                                const std::filesystem::path& clip) {
  const drivers::Driver* driver = drivers::find_driver(name);
  if (driver == nullptr || driver->emulate == nullptr) {
    return misuse("driver '" + name + "' has no emulator, so it cannot be used here");
  }
  auto motion = clip::read_hand_clip(clip);
  if (!motion) return std::unexpected(motion.error());
  const auto options = drivers::complete_options(*driver, {});
  if (!options) return std::unexpected(options.error());
  auto emulator = driver->emulate(*options);
  if (!emulator) return std::unexpected(emulator.error());
  auto port = EmulatedPort::open_pty();
  if (!port) return std::unexpected(port.error());
  return std::unique_ptr<SyntheticSigner>(
      new SyntheticSigner(std::move(*emulator), std::move(*port), std::move(*motion)));
}

SyntheticSigner::SyntheticSigner(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                                 clip::HandClip clip)
    : clip_(std::move(clip)),
      glove_(std::move(emulator), std::move(port),
             hand_motion([this](double time_s) { return pose_at(clip_, time_s); }), {}),
      thread_([this](const std::stop_token& stop) { glove_.run(stop); }) {}

}  // namespace posed::emulate
