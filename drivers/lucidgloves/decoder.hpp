// Decodes each line of a LucidGlove into a frame and a sample.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/glove/glove_decoder.hpp"
#include "drivers/glove/line_reader.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/lucidgloves/protocol.hpp"

namespace posed::drivers::lucidgloves {

// What the options and the device info say.
struct Settings {
  Side hand = Side::kRight;
  Encoding encoding = Encoding::kAuto;
  int max_analog = 4095;
};

// Twenty joints (finger by finger, from the palm outwards) and five splays.
inline constexpr std::size_t kSensors = kFingers * kJoints + kFingers;

Result<glove::Model> model(const Settings& settings);
[[nodiscard]] std::vector<std::string> extra_names();

class LucidDecoder final : public glove::GloveDecoder {
 public:
  LucidDecoder(std::shared_ptr<const Skeleton> skeleton,
               std::shared_ptr<const glove::Calibration> calibration, const Settings& settings)
      : GloveDecoder(std::move(skeleton), std::move(calibration)), settings_(settings) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 protected:
  // A glove without splay sensors gets splay zero.
  RT_SAFE void compute(std::span<float> value,
                       std::bitset<glove::kMaxSensors>& valid) const noexcept override;

 private:
  void accept_line(std::string_view text, Sink& sink) noexcept;
  [[nodiscard]] bool lost_a_key(const Line& line) noexcept;
  void emit_line(const Line& line, Sink& sink) noexcept;

  Settings settings_;
  glove::LineReader<kMaxLine> lines_;
  std::bitset<kSplay> usual_{};  // fingers and joints that the glove normally sends
  int unusual_lines_ = 0;        // consecutive lines that lacked one of them
  std::array<int, 3> info_{};    // last values received
  std::bitset<3> has_info_{};
};

}  // namespace posed::drivers::lucidgloves
