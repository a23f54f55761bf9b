// SyntheticSigner: an emulated glove, worn by somebody whose motion is a clip, on a thread of its
// own: the demo's live hand. From labels over angles and the glove's bytes to a pseudo-terminal,
// everything behind it is what a real glove goes through.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "daemon/emulate/emulated_glove.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

class SyntheticSigner {
 public:
  // Wears a glove of this driver, with its default options.
  [[nodiscard]] static Result<std::unique_ptr<SyntheticSigner>> start(
      const std::string& driver, const std::filesystem::path& clip);
  SyntheticSigner(const SyntheticSigner&) = delete;
  SyntheticSigner& operator=(const SyntheticSigner&) = delete;

  [[nodiscard]] const std::string& port() const noexcept { return glove_.port(); }

 private:
  SyntheticSigner(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                  clip::HandClip clip);

  clip::HandClip clip_;
  EmulatedGlove glove_;
  std::jthread thread_;
};

}  // namespace posed::emulate
