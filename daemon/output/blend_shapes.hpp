// BlendShapes: the values of a face among the samples of a stream, under the names that VRM models
// of version 0 or 1 have for them.
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

// "Joy" and "happy" are one preset; a name that is no preset stays as it is.
[[nodiscard]] std::string_view preset_name(std::string_view name, VrmNames wanted) noexcept;

// One thread.
class BlendShapes {
 public:
  explicit BlendShapes(VrmNames names) : names_(names) {}

  // The samples of the stream that comes. Values without unit whose name has no '/' are blend
  // shapes; those beyond what a frame of the protocol has room for are left out. Returns how many
  // those are. Cold.
  std::size_t set_layout(const drivers::SampleLayout& samples);

  void add(const Sample& sample) noexcept;

  // Writes the values that were measured, and that they are complete; nothing if there are none.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Shape {
    std::size_t index = 0;  // of the sample's value
    std::string name;       // as it is sent
    float value = 0.0F;
    bool known = false;
  };
  VrmNames names_;
  std::vector<Shape> shapes_;
};

}  // namespace posed::output
