// Who moves an emulated device: a clip of a person, or a synthetic signer. Cold.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/emulator.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

// The people of `emulator` perform the clips, the first person the first clip, and those behind the
// last clip begin with the first again: retargeted to their skeletons, interpolated between frames
// and repeated in a loop. Bodies that share no bone with their clip, such as props, move as before.
// With more clips than people it gets more, if the device can have them. Cold.
Result<Motion> clip_motion(const std::vector<std::filesystem::path>& paths,
                           drivers::Emulator& emulator);

// SyntheticSigner: an emulated glove with a clip as its hand motion, on its own thread; the live
// hand of the demo. It goes from labels through angles to the glove's bytes on a pseudo-terminal;
// everything behind that is the same as for a real glove.
class SyntheticSigner {
 public:
  // Starts a glove of this driver, with its default options. `realtime`: it asks for the rights of
  // the daemon's threads, so that it keeps its rate on a busy machine, as a device does.
  static Result<std::unique_ptr<SyntheticSigner>> start(const std::string& driver,
                                                        const std::filesystem::path& clip,
                                                        bool realtime);
  SyntheticSigner(const SyntheticSigner&) = delete;
  SyntheticSigner& operator=(const SyntheticSigner&) = delete;

  [[nodiscard]] const std::string& port() const noexcept { return glove_.port(); }

 private:
  SyntheticSigner(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                  clip::HandClip clip, bool realtime);

  clip::HandClip clip_;
  EmulatedDevice glove_;
  std::jthread thread_;
};

}  // namespace posed::emulate
