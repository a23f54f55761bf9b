// Performer: an emulated glove, worn by somebody whose motion is a clip, on a thread of its own:
// the demo's live hand. From labels over angles and the glove's bytes to a pseudo-terminal,
// everything behind it is what a real glove goes through.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "daemon/devices/emulated_glove.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

class Performer {
 public:
  // Wears a glove of this driver, with its default options.
  [[nodiscard]] static Result<std::unique_ptr<Performer>> start(const std::string& driver,
                                                                const std::filesystem::path& clip);
  Performer(const Performer&) = delete;
  Performer& operator=(const Performer&) = delete;

  [[nodiscard]] const std::string& port() const noexcept { return glove_.port(); }

 private:
  Performer(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port, clip::HandClip clip);

  clip::HandClip clip_;
  EmulatedGlove glove_;
  std::jthread thread_;
};

}  // namespace posed::devices
