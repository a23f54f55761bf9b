// Numbers and tracks of a glTF model that is being built: all numbers go into its one buffer, which
// becomes the binary part of the file. Cold.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <tiny_gltf.h>

namespace posed::clip {

// What a file that posed wrote says of itself, and a sentence for the user about an animation, in
// its extras.
inline constexpr const char* kGltfGenerator = "posed";
inline constexpr const char* kGltfRemark = "posed_remark";

template <typename Number>
constexpr int kComponent = TINYGLTF_COMPONENT_TYPE_FLOAT;
template <>
inline constexpr int kComponent<std::uint16_t> = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;

// `type` is one of TINYGLTF_TYPE_*. Returns the number of the accessor. The model has a buffer.
// glTF wants the bounds of times and places.
template <typename Number>
int add_accessor(tinygltf::Model& model, const std::vector<Number>& values, int type,
                 bool bounds = false) {
  auto& data = model.buffers.front().data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = data.size();
  view.byteLength = values.size() * sizeof(Number);
  static_assert(std::endian::native == std::endian::little, "glTF's numbers are little-endian");
  const auto bytes = std::as_bytes(std::span(values));
  for (const std::byte byte : bytes) data.push_back(static_cast<unsigned char>(byte));
  data.resize((data.size() + 3) / 4 * 4);  // the next numbers may be floats
  model.bufferViews.push_back(std::move(view));
  tinygltf::Accessor accessor;
  accessor.bufferView = static_cast<int>(model.bufferViews.size()) - 1;
  accessor.componentType = kComponent<Number>;
  accessor.type = type;
  const auto parts =
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  accessor.count = values.size() / parts;
  if (bounds) {
    accessor.minValues.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(parts));
    accessor.maxValues = accessor.minValues;
    for (std::size_t i = parts; i < values.size(); ++i) {
      double& least = accessor.minValues[i % parts];
      double& most = accessor.maxValues[i % parts];
      least = std::min<double>(least, values[i]);
      most = std::max<double>(most, values[i]);
    }
  }
  model.accessors.push_back(std::move(accessor));
  return static_cast<int>(model.accessors.size()) - 1;
}

// How a node moves: `path` is "translation" or "rotation", `times` an accessor's number. Without
// values it does not.
inline void add_track(tinygltf::Model& model, tinygltf::Animation& animation, int times, int node,
                      const char* path, const std::vector<float>& values, int type) {
  if (values.empty()) return;
  tinygltf::AnimationSampler sampler;
  sampler.input = times;
  sampler.output = add_accessor(model, values, type);
  sampler.interpolation = "LINEAR";
  tinygltf::AnimationChannel channel;
  channel.sampler = static_cast<int>(animation.samplers.size());
  channel.target_node = node;
  channel.target_path = path;
  animation.samplers.push_back(std::move(sampler));
  animation.channels.push_back(std::move(channel));
}

}  // namespace posed::clip
