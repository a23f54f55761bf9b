#include "daemon/output/blend_shapes.hpp"

#include <array>

#include "drivers/vmc/protocol.hpp"

namespace posed::output {
namespace {

struct Preset {
  std::string_view vrm0, vrm1;
};

// VRM 0 as Unity's programs spell it. VRM 1's "surprised" has no counterpart.
constexpr std::array<Preset, 17> kPresets{{{"Joy", "happy"},
                                           {"Angry", "angry"},
                                           {"Sorrow", "sad"},
                                           {"Fun", "relaxed"},
                                           {"Neutral", "neutral"},
                                           {"A", "aa"},
                                           {"I", "ih"},
                                           {"U", "ou"},
                                           {"E", "ee"},
                                           {"O", "oh"},
                                           {"Blink", "blink"},
                                           {"Blink_L", "blinkLeft"},
                                           {"Blink_R", "blinkRight"},
                                           {"LookUp", "lookUp"},
                                           {"LookDown", "lookDown"},
                                           {"LookLeft", "lookLeft"},
                                           {"LookRight", "lookRight"}}};

// Of the writer's memory for a frame, beside all bones.
constexpr std::size_t kRoomForShapes = std::size_t{16} * 1024;
constexpr std::size_t kBytesBesideName = 40;  // of a message in a bundle

}  // namespace

std::string_view preset_name(std::string_view name, VrmNames wanted) noexcept {
  for (const Preset& preset : kPresets) {
    if (name != preset.vrm0 && name != preset.vrm1) continue;
    return wanted == VrmNames::kVrm0 ? preset.vrm0 : preset.vrm1;
  }
  return name;
}

std::size_t BlendShapes::set_layout(const drivers::SampleLayout& samples) {
  shapes_.clear();
  std::size_t left_out = 0, used = 0;
  for (std::size_t i = 0; i < samples.names.size(); ++i) {
    const std::string& name = samples.names[i];
    if (samples.units[i] != "1" || name.contains('/')) continue;
    used += name.size() + kBytesBesideName;
    if (name.empty() || name.size() > drivers::vmc::kMaxVmcName || used > kRoomForShapes) {
      ++left_out;
      continue;
    }
    shapes_.push_back({.index = i, .name = std::string(preset_name(name, names_))});
  }
  return left_out;
}

void BlendShapes::update(const Sample& sample) noexcept {
  for (Shape& shape : shapes_) {
    if (shape.index >= sample.value_count || !sample.valid[shape.index]) continue;
    shape.value = sample.value[shape.index];
    shape.known = true;
  }
}

void BlendShapes::write(drivers::vmc::DatagramWriter& writer) const noexcept {
  for (const Shape& shape : shapes_) {
    if (shape.known) writer.blend(shape.name, shape.value);
  }
  writer.apply();
}

}  // namespace posed::output
