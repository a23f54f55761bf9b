#include "proto/clip/gltf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tiny_gltf.h>

#include "proto/clip/formats.hpp"
#include "proto/clip/gltf_numbers.hpp"
#include "proto/clip/mannequin.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr std::size_t kMaxBytes = std::numeric_limits<std::uint32_t>::max() / 2;

// An animation's "timecode" is that of its first key, "timecodes" those of all; no extension of
// glTF has a place for them.
tinygltf::Value timecode_extras(const std::vector<Timecode>& all) {
  if (all.empty()) return {};
  tinygltf::Value::Array each;
  for (const Timecode& code : all) each.emplace_back(std::string(view_of(code)));
  return tinygltf::Value(
      tinygltf::Value::Object{{"timecode", each.front()}, {"timecodes", tinygltf::Value(each)}});
}

// Fills a tinygltf model: all numbers go into one buffer, which becomes the binary part of the
// file.
class ModelBuilder {
 public:
  explicit ModelBuilder(const GltfMotion& motion) : motion_(motion) {
    model_.asset.version = "2.0";
    model_.asset.generator = kGltfGenerator;
    model_.buffers.emplace_back();
  }

  [[nodiscard]] tinygltf::Model build(GltfKind kind) {
    add_nodes();
    add_animation();
    if (kind == GltfKind::kSkin) {
      add_skin();
      add_mannequin();
    }
    if (kind == GltfKind::kVrmAnimation) add_humanoid();
    return std::move(model_);
  }

 private:
  void add_nodes() {
    for (const GltfNode& from : motion_.nodes) {
      tinygltf::Node node;
      node.name = clean(from.name);  // JSON is UTF-8; a clip's names may hold any bytes
      node.translation = {from.offset_m.x(), from.offset_m.y(), from.offset_m.z()};
      if (from.parent >= 0) {
        model_.nodes[from.parent].children.push_back(static_cast<int>(model_.nodes.size()));
      }
      model_.nodes.push_back(std::move(node));
    }
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(std::move(scene));
    model_.defaultScene = 0;
  }

  void add_animation() {
    tinygltf::Animation animation;
    animation.name = clean(motion_.name);
    const int times = add_accessor(model_, motion_.time_s, TINYGLTF_TYPE_SCALAR, true);
    for (std::size_t i = 0; i < motion_.nodes.size(); ++i) {
      const GltfNode& node = motion_.nodes[i];
      const int index = static_cast<int>(i);
      add_track(model_, animation, times, index, "translation", node.position_m,
                TINYGLTF_TYPE_VEC3);
      add_track(model_, animation, times, index, "rotation", node.rotation_xyzw,
                TINYGLTF_TYPE_VEC4);
    }
    animation.extras = timecode_extras(motion_.timecode);
    // glTF does not allow an animation of nothing: a figure without channels stands still.
    if (!animation.channels.empty()) model_.animations.push_back(std::move(animation));
  }

  // Blender makes bones only of the joints of a skin, and takes their places at rest from the
  // inverse bind matrices.
  void add_skin() {
    tinygltf::Skin skin;
    skin.name = clean(motion_.name);
    skin.skeleton = 0;
    std::vector<Eigen::Vector3d> place_m;  // in the world, at rest
    std::vector<float> matrices;           // column by column
    for (const GltfNode& node : motion_.nodes) {
      skin.joints.push_back(static_cast<int>(place_m.size()));
      place_m.push_back(node.offset_m);
      if (node.parent >= 0) place_m.back() += place_m[node.parent];
      for (int i = 0; i < 16; ++i) matrices.push_back(i % 5 == 0 ? 1.0F : 0.0F);
      for (int i = 0; i < 3; ++i) {
        matrices[matrices.size() - 4 + static_cast<std::size_t>(i)] =
            -static_cast<float>(place_m.back()[i]);
      }
    }
    skin.inverseBindMatrices = add_accessor(model_, matrices, TINYGLTF_TYPE_MAT4);
    model_.skins.push_back(std::move(skin));
  }

  // Viewers show a skin only where a mesh has it. The mesh is no part of the figure: glTF ignores
  // the place of a node with a skin.
  void add_mannequin() {
    const Mannequin body = mannequin_of(motion_.nodes);
    if (body.node.empty()) return;
    std::vector<std::uint16_t> joints;
    std::vector<float> weights;
    for (const std::uint16_t node : body.node) {
      joints.insert(joints.end(), {node, 0, 0, 0});
      weights.insert(weights.end(), {1.0F, 0.0F, 0.0F, 0.0F});
    }
    tinygltf::Primitive triangles;
    triangles.mode = TINYGLTF_MODE_TRIANGLES;
    triangles.attributes = {
        {"POSITION", add_accessor(model_, body.position_m, TINYGLTF_TYPE_VEC3, true)},
        {"NORMAL", add_accessor(model_, body.normal, TINYGLTF_TYPE_VEC3)},
        {"JOINTS_0", add_accessor(model_, joints, TINYGLTF_TYPE_VEC4)},
        {"WEIGHTS_0", add_accessor(model_, weights, TINYGLTF_TYPE_VEC4)}};
    triangles.indices = add_accessor(model_, body.corner, TINYGLTF_TYPE_SCALAR);
    triangles.material = 0;
    tinygltf::Material skin;
    skin.name = "mannequin";
    skin.pbrMetallicRoughness.baseColorFactor = {0.55, 0.6, 0.68, 1.0};
    skin.pbrMetallicRoughness.metallicFactor = 0.0;
    skin.pbrMetallicRoughness.roughnessFactor = 0.8;
    model_.materials.push_back(std::move(skin));
    tinygltf::Mesh mesh;
    mesh.name = "mannequin";
    mesh.primitives.push_back(std::move(triangles));
    model_.meshes.push_back(std::move(mesh));
    tinygltf::Node node;
    node.name = "mannequin";
    node.mesh = 0;
    node.skin = 0;
    model_.scenes.front().nodes.push_back(static_cast<int>(model_.nodes.size()));
    model_.nodes.push_back(std::move(node));
  }

  void add_humanoid() {
    using tinygltf::Value;
    Value::Object bones;
    for (std::size_t i = 0; i < motion_.nodes.size(); ++i) {
      if (!motion_.nodes[i].bone) continue;
      bones[std::string(bone_name(*motion_.nodes[i].bone))] =
          Value(Value::Object{{"node", Value(static_cast<int>(i))}});
    }
    constexpr const char* kExtension = "VRMC_vrm_animation";
    model_.extensions[kExtension] =
        Value(Value::Object{{"specVersion", Value(std::string("1.0"))},
                            {"humanoid", Value(Value::Object{{"humanBones", Value(bones)}})}});
    model_.extensionsUsed = {kExtension};
  }

  const GltfMotion& motion_;
  tinygltf::Model model_;
};

bool all_finite(const std::vector<float>& values) {
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

Result<> check(const GltfMotion& motion, const std::string& path) {
  std::size_t numbers = motion.time_s.size();
  for (const GltfNode& node : motion.nodes) {
    numbers += node.position_m.size() + node.rotation_xyzw.size() + 16;
    if (node.offset_m.allFinite() && all_finite(node.position_m) &&
        all_finite(node.rotation_xyzw)) {
      continue;
    }
    return fail("joint " + in_quotes(node.name) + " has no value in some frames; fill them first",
                path);
  }
  if (numbers * sizeof(float) < kMaxBytes) return {};
  return fail("would be longer than a glTF file can be; write a part of the clip", path);
}

GltfNode end_site_of(const Joint& joint, int parent) {
  return {.name = joint.name + "_end", .parent = parent, .offset_m = *joint.end_site_m};
}

std::span<const double> values_of(const Clip& clip, int frame) {
  const auto row = clip.channels.row(frame);
  return {row.data(), static_cast<std::size_t>(row.size())};
}

}  // namespace

Result<std::vector<float>> gltf_times(const Clip& clip) {
  if (clip.frames() == 0) return fail("has no frames, so there is nothing to write", clip.path);
  std::vector<float> time_s;
  double last_s = 0.0;
  for (int i = 0; i < clip.frames(); ++i) {
    const double now_s = clip.time_of_s(i) - clip.time_of_s(0);
    auto rounded_s = static_cast<float>(now_s);
    if (!std::isfinite(rounded_s) || now_s < last_s) {
      return fail("the time of frame " + std::to_string(i + 1) +
                      " is before that of the last one, or is none; mend the clip's times",
                  clip.path);
    }
    if (i > 0 && rounded_s <= time_s.back()) {
      rounded_s = std::nextafter(time_s.back(), std::numeric_limits<float>::max());
    }
    time_s.push_back(rounded_s);
    last_s = now_s;
  }
  return time_s;
}

void add_rotation(GltfNode& node, Eigen::Quaterniond rotation) {
  const std::vector<float>& before = node.rotation_xyzw;
  if (!before.empty() && Eigen::Map<const Eigen::Vector4f>(&before[before.size() - 4])
                                 .cast<double>()
                                 .dot(rotation.coeffs()) < 0.0) {
    rotation.coeffs() *= -1.0;
  }
  for (int i = 0; i < 4; ++i) {
    node.rotation_xyzw.push_back(static_cast<float>(rotation.coeffs()[i]));
  }
}

void add_position(GltfNode& node, const Eigen::Vector3d& position_m) {
  for (int i = 0; i < 3; ++i) node.position_m.push_back(static_cast<float>(position_m[i]));
}

Result<> write_gltf(const GltfMotion& motion, GltfKind kind, const std::filesystem::path& path) {
  TRY(check(motion, path.string()));
  const tinygltf::Model model = ModelBuilder(motion).build(kind);
  return write_whole_file(path, [&model](std::ostream& file) {
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model, file, false, true)) {
      file.setstate(std::ios::failbit);
    }
  });
}

Result<> write_glb(const Clip& clip, const std::filesystem::path& path) {
  auto time_s = TRY(gltf_times(clip));
  const Skeleton& skeleton = *clip.skeleton;
  GltfMotion motion{.name = path.stem().string(), .time_s = std::move(time_s), .nodes = {}};
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const Joint& joint = skeleton.joints[j];
    GltfNode node{.name = joint.name, .parent = joint.parent, .offset_m = joint.offset_m};
    node.bone = joint.bone;
    const auto channels = channels_of(skeleton, j);
    const auto first = channels.data() - skeleton.channels.data();
    const bool moves = std::ranges::any_of(channels, &Channel::translation);
    const bool turns = !std::ranges::all_of(channels, &Channel::translation);
    for (int i = 0; i < clip.frames(); ++i) {
      const auto values = values_of(clip, i);
      if (moves) add_position(node, local_position(joint, channels, values.data() + first));
      if (turns) add_rotation(node, local_rotation(skeleton, j, values));
    }
    motion.nodes.push_back(std::move(node));
  }
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {  // behind all joints, to keep their order
    if (skeleton.joints[j].end_site_m) {
      motion.nodes.push_back(end_site_of(skeleton.joints[j], j));
    }
  }
  motion.timecode = clip.timecode;
  return write_gltf(motion, GltfKind::kSkin, path);
}

Format glb_format() {
  return {
      .name = "GLB",
      .extensions = {".glb"},
      .options = {ReadOption::kUnit, ReadOption::kUp, ReadOption::kFacing, ReadOption::kProfile},
      .sniff = [](std::string_view begin) { return begin.starts_with("glTF"); },
      .read = read_gltf,
      .write = write_glb};
}

}  // namespace posed::clip
