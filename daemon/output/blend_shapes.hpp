// BlendShapes: finds the values of a face among the samples of a stream and writes them under the
// names that VRM models of version 0 or 1 have for them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/vmc/messages.hpp"
#include "proto/frame/frame.hpp"

namespace posed::output {

enum class VrmNames : std::uint8_t { kVrm0, kVrm1 };

// Returns the preset's name in the wanted version ("Joy" and "happy" are one preset); a name that
// is no preset stays as it is.
[[nodiscard]] std::string_view preset_name(std::string_view name, VrmNames wanted) noexcept;

// One thread.
class BlendShapes {
 public:
  explicit BlendShapes(VrmNames names) : names_(names) {}

  // Sets the layout of the stream's samples. Values without unit whose name has no '/' are blend
  // shapes; those for which a frame of the protocol has no room are left out. Returns how many were
  // left out. Cold.
  std::size_t set_layout(const drivers::SampleLayout& samples);

  void update(const Sample& sample) noexcept;

  // Writes the values that were measured, and the message that ends a frame: some receivers move
  // their bones only when it comes.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Shape {
    std::size_t index = 0;  // the place of its value in a sample
    std::string name;       // the name that is sent
    float value = 0.0F;
    bool known = false;
  };
  VrmNames names_;
  std::vector<Shape> shapes_;
};

}  // namespace posed::output
