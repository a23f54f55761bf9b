// Decodes each line of a LucidGlove into a frame and a sample.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/lucidgloves/protocol.hpp"

namespace posed::drivers::lucidgloves {

// The settings of a glove that the decoder needs, from its device info.
struct Settings {
  Encoding encoding = Encoding::kAuto;
  int max_analog = 4095;
};

// Twenty joints (finger by finger, from the palm outwards) and five splays.
inline constexpr std::size_t kSensors = kFingers * kJoints + kFingers;

[[nodiscard]] Result<glove::Model> model(const Settings& settings);
[[nodiscard]] std::vector<std::string> extra_names();

class LucidDecoder final : public glove::GloveDecoder {
 public:
  LucidDecoder(std::shared_ptr<const Skeleton> skeleton,
               std::shared_ptr<const glove::Calibration> calibration, const Settings& settings)
      : GloveDecoder(std::move(skeleton), std::move(calibration)), settings_(settings) {}

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 protected:
  // A glove without splay sensors gets splay zero. RT-safe.
  void compute(std::span<float> value,
               std::bitset<glove::kMaxSensors>& valid) const noexcept override;

 private:
  void keep(std::span<const std::byte> piece, Sink& sink) noexcept;
  void end_line(Sink& sink) noexcept;
  [[nodiscard]] bool lost_a_key(const Line& line) noexcept;
  void emit_line(const Line& line, Sink& sink) noexcept;

  Settings settings_;
  std::array<char, kMaxLine> text_{};
  std::size_t length_ = 0;
  bool overlong_ = false;        // the rest of the line is discarded
  std::bitset<kSplay> usual_{};  // fingers and joints that the glove normally sends
  int unusual_lines_ = 0;        // consecutive lines that lacked one of them
  std::array<int, 3> info_{};    // last values received
  std::bitset<3> has_info_{};
};

}  // namespace posed::drivers::lucidgloves
