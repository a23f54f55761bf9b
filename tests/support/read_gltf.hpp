// A .glb or .vrma as a viewer sees it: its nodes, and where they are in the world at a key of the
// animation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

namespace posed::test {

class ReadGltf {
 public:
  explicit ReadGltf(const std::filesystem::path& path) {
    std::string error, warning;
    const bool read =
        tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, path.string());
    INFO(error << warning);
    REQUIRE(read);
    REQUIRE(warning.empty());
    parent.assign(model.nodes.size(), -1);
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      for (const int child : model.nodes[i].children) {
        parent.at(static_cast<std::size_t>(child)) = static_cast<int>(i);
      }
    }
    REQUIRE(model.animations.size() == 1);
    time_s = numbers(model.animations[0].samplers.at(0).input);
  }

  [[nodiscard]] std::vector<float> numbers(int index) const {
    const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(index));
    const auto& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
    const auto& data = model.buffers.at(0).data;
    REQUIRE(accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT);
    REQUIRE(view.byteOffset + view.byteLength <= data.size());
    std::vector<float> values(view.byteLength / sizeof(float));
    std::memcpy(values.data(), data.data() + view.byteOffset, view.byteLength);
    const int parts = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
    REQUIRE(values.size() == accessor.count * static_cast<std::size_t>(parts));
    return values;
  }

  // [node], node's frame to the world.
  [[nodiscard]] std::vector<Eigen::Isometry3d> at(std::size_t key) const {
    std::vector<Eigen::Vector3d> position(model.nodes.size());
    std::vector<Eigen::Quaterniond> rotation(model.nodes.size(), Eigen::Quaterniond::Identity());
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
      const std::vector<double>& place = model.nodes[i].translation;  // a mesh's node has none
      position[i] = place.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(place.data());
    }
    for (const tinygltf::AnimationChannel& channel : model.animations[0].channels) {
      const auto& sampler =
          model.animations[0].samplers.at(static_cast<std::size_t>(channel.sampler));
      const std::vector<float> values = numbers(sampler.output);
      const auto node = static_cast<std::size_t>(channel.target_node);
      if (channel.target_path == "translation") {
        position[node] = Eigen::Map<const Eigen::Vector3f>(&values.at(3 * key)).cast<double>();
      } else {
        rotation[node].coeffs() =
            Eigen::Map<const Eigen::Vector4f>(&values.at(4 * key)).cast<double>();
      }
    }
    std::vector<Eigen::Isometry3d> world(model.nodes.size());
    for (std::size_t i = 0; i < world.size(); ++i) {
      Eigen::Isometry3d local = Eigen::Isometry3d::Identity();
      local.translate(position[i]);
      local.rotate(rotation[i]);
      world[i] = parent[i] < 0 ? local : world.at(static_cast<std::size_t>(parent[i])) * local;
    }
    return world;
  }

  tinygltf::Model model;
  std::vector<int> parent;  // [node], -1 at the root
  std::vector<float> time_s;
};

}  // namespace posed::test
