#include "proto/fbx/glb_of_fbx.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>
#include <tiny_gltf.h>
#include <Eigen/Geometry>
#include <assimp/Importer.hpp>

#include "proto/clip/gltf_numbers.hpp"
#include "proto/text/clean.hpp"

namespace posed::fbx {
namespace {

// Assimp's name for a part of a joint's turn: "Hips_$AssimpFbx$_PreRotation".
constexpr std::string_view kPart = "_$AssimpFbx$_";
constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxNumbers = 50'000'000;  // of all frames
constexpr double kMinRate_hz = 1.0, kUsualRate_hz = 30.0;
constexpr double kSparse = 1.5;  // frames a key

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  return Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(&m.a1).cast<double>();
}

std::string text_of(const aiString& text) { return {text.data, text.length}; }

// --- the file

Result<const aiScene*> load(Assimp::Importer& importer, std::string_view bytes) {
  // A file that only says that it is FBX must not reach the readers of other formats.
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    const aiImporterDesc* about = importer.GetImporterInfo(i);
    const bool reads_fbx =
        about != nullptr && std::strstr(about->mFileExtensions, "fbx") != nullptr;
    if (!reads_fbx) importer.UnregisterLoader(importer.GetImporter(i));
  }
  for (const char* unused :
       {AI_CONFIG_IMPORT_FBX_READ_MATERIALS, AI_CONFIG_IMPORT_FBX_READ_TEXTURES,
        AI_CONFIG_IMPORT_FBX_READ_ALL_GEOMETRY_LAYERS}) {
    importer.SetPropertyBool(unused, false);
  }
  // Without the parts assimp loses the animation of a joint that has a pivot.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_REMOVE_EMPTY_BONES, false);
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "fbx");
  if (scene != nullptr && scene->mRootNode != nullptr) return scene;
  return fail("is no FBX that can be read (" + clean(importer.GetErrorString()) +
              "); export it again, as binary FBX of 2011 or later");
}

// The root's transform: from the file's unit and axes to metres with +Y up. FBX names the axis that
// points up and the one that points to the figure's left; the third follows.
Eigen::Matrix4d to_metres(const aiScene& scene) {
  const auto number = [&scene](const char* key, double otherwise) {
    float value = 0.0F;
    double wide = 0.0;
    std::int32_t whole = 0;
    if (scene.mMetaData == nullptr) return otherwise;
    if (scene.mMetaData->Get(key, wide)) return wide;
    if (scene.mMetaData->Get(key, value)) return static_cast<double>(value);
    return scene.mMetaData->Get(key, whole) ? static_cast<double>(whole) : otherwise;
  };
  const auto axis = [&number](const std::string& name, int otherwise) {
    const double index = number(name.c_str(), otherwise);
    const int at =
        index == 0.0 || index == 1.0 || index == 2.0 ? static_cast<int>(index) : otherwise;
    const double sign = number((name + "Sign").c_str(), 1.0) < 0.0 ? -1.0 : 1.0;
    return Eigen::Vector3d(sign * Eigen::Vector3d::Unit(at));
  };
  Eigen::Vector3d left = axis("CoordAxis", 0), up = axis("UpAxis", 1);
  if (left.cross(up).norm() < 0.5) left = Eigen::Vector3d::UnitX(), up = Eigen::Vector3d::UnitY();
  double centimetres = number("UnitScaleFactor", 1.0);
  if (!(centimetres >= 1e-4 && centimetres <= 1e5)) centimetres = 1.0;
  Eigen::Matrix4d root = Eigen::Matrix4d::Identity();
  root.row(0).head<3>() = 0.01 * centimetres * left;
  root.row(1).head<3>() = 0.01 * centimetres * up;
  root.row(2).head<3>() = 0.01 * centimetres * left.cross(up);
  return root;
}

// --- nodes

struct Node {
  std::string name;
  int parent = -1;
  std::vector<const aiNode*> parts;  // outermost first; the last one is the node itself
  bool limb = false;                 // can be a joint: no mesh, camera, light or mere place

  [[nodiscard]] Eigen::Matrix4d rest() const {
    Eigen::Matrix4d product = Eigen::Matrix4d::Identity();
    for (const aiNode* part : parts) product *= matrix_of(part->mTransformation);
    return product;
  }
};

std::set<std::string> lights_and_cameras(const aiScene& scene) {
  std::set<std::string> names;
  for (unsigned i = 0; i < scene.mNumLights; ++i) names.insert(text_of(scene.mLights[i]->mName));
  for (unsigned i = 0; i < scene.mNumCameras; ++i) names.insert(text_of(scene.mCameras[i]->mName));
  return names;
}

// All nodes, parents first, without assimp's parts, which become the next node's.
Result<std::vector<Node>> nodes_of(const aiScene& scene) {
  struct Open {
    const aiNode* node;
    int parent;
    std::vector<const aiNode*> parts;
  };
  const auto others = lights_and_cameras(scene);
  std::vector<Node> nodes;
  std::vector<Open> open{{scene.mRootNode, -1, {}}};
  while (!open.empty()) {
    Open at = std::move(open.back());
    open.pop_back();
    at.parts.push_back(at.node);
    int parent = at.parent;
    if (std::string name = text_of(at.node->mName); !name.contains(kPart)) {
      bool is_null = false;
      if (at.node->mMetaData != nullptr) at.node->mMetaData->Get("IsNull", is_null);
      const bool limb =
          parent >= 0 && !is_null && at.node->mNumMeshes == 0 && !others.contains(name);
      parent = static_cast<int>(nodes.size());
      nodes.push_back({std::move(name), at.parent, std::move(at.parts), limb});
      at.parts.clear();
    }
    if (nodes.size() > kMaxNodes) return fail("has too many nodes to be a figure");
    for (unsigned i = at.node->mNumChildren; i-- > 0;) {
      open.push_back({at.node->mChildren[i], parent, at.parts});
    }
  }
  return nodes;
}

// --- animations

using Channels = std::map<std::string, const aiNodeAnim*>;

Channels channels_of(const aiAnimation& animation) {
  Channels channels;
  for (unsigned i = 0; i < animation.mNumChannels; ++i) {
    channels.emplace(text_of(animation.mChannels[i]->mNodeName), animation.mChannels[i]);
  }
  return channels;
}

template <typename Key>
std::pair<const Key*, const Key*> around(const Key* keys, unsigned count, double tick) {
  const Key* next = std::upper_bound(keys, keys + count, tick,
                                     [](double t, const Key& key) { return t < key.mTime; });
  return {next == keys ? keys : next - 1, next == keys + count ? next - 1 : next};
}

template <typename Key>
float share(const std::pair<const Key*, const Key*>& keys, double tick) {
  const double span = keys.second->mTime - keys.first->mTime;
  return span > 0.0 ? static_cast<float>(std::clamp((tick - keys.first->mTime) / span, 0.0, 1.0))
                    : 0.0F;
}

aiVector3D value_at(const aiVectorKey* keys, unsigned count, double tick,
                    const aiVector3D& otherwise) {
  if (count == 0) return otherwise;
  const auto near = around(keys, count, tick);
  return near.first->mValue + (near.second->mValue - near.first->mValue) * share(near, tick);
}

Eigen::Matrix4d local_at(const aiNodeAnim& channel, double tick) {
  const auto scale =
      value_at(channel.mScalingKeys, channel.mNumScalingKeys, tick, aiVector3D(1, 1, 1));
  const auto place = value_at(channel.mPositionKeys, channel.mNumPositionKeys, tick, aiVector3D());
  aiQuaternion turn;
  if (channel.mNumRotationKeys > 0) {
    const auto near = around(channel.mRotationKeys, channel.mNumRotationKeys, tick);
    aiQuaternion::Interpolate(turn, near.first->mValue, near.second->mValue, share(near, tick));
  }
  return matrix_of(aiMatrix4x4(scale, turn, place));
}

// The node's transform in its parent's frame. Of a joint with pre- and post-rotation but without
// pivots assimp 5.2 animates all parts at once, under the joint's own name, with the post-rotation
// as it is instead of its inverse, which the part at rest is.
Eigen::Matrix4d local_at(const Node& node, const Channels& channels, double tick) {
  const auto own = channels.find(node.name);
  Eigen::Matrix4d product = Eigen::Matrix4d::Identity();
  if (own != channels.end()) {
    product = local_at(*own->second, tick);
    for (const aiNode* part : node.parts) {
      if (!text_of(part->mName).ends_with("_PostRotation")) continue;
      const Eigen::Matrix4d back = matrix_of(part->mTransformation);
      product = product * back * back;
    }
    return product;
  }
  for (const aiNode* part : node.parts) {
    const auto channel = channels.find(text_of(part->mName));
    product *= channel == channels.end() ? matrix_of(part->mTransformation)
                                         : local_at(*channel->second, tick);
  }
  return product;
}

bool moves(const Node& node, const Channels& channels) {
  return std::ranges::any_of(
      node.parts, [&](const aiNode* part) { return channels.contains(text_of(part->mName)); });
}

struct Ticks {
  std::vector<double> at{0.0};  // at which an animation is sampled
  bool sparse = false;          // there is much between two keys
};

// Whether something moves between two keys that lie several frames apart.
bool has_wide_gaps(const aiNodeAnim& channel, double frame) {
  const auto wide = [&](const auto* keys, unsigned count) {
    for (unsigned k = 1; k < count; ++k) {
      if (keys[k].mTime - keys[k - 1].mTime > kSparse * frame &&
          keys[k].mValue != keys[k - 1].mValue)
        return true;
    }
    return false;
  };
  return wide(channel.mPositionKeys, channel.mNumPositionKeys) ||
         wide(channel.mRotationKeys, channel.mNumRotationKeys);
}

// Those that most channels with several keys share, if these are evenly spaced (assimp adds keys
// where an angle jumps) and no farther apart than the file's frames, otherwise the file's frames.
Result<Ticks> ticks_of(const aiAnimation& animation) {
  // Assimp multiplies all times by the rate, and takes the one that a file does not name for -1.
  if (!(animation.mTicksPerSecond > 0.0)) {
    return fail("names no frame rate, so its times are lost; export it with one");
  }
  // Where the file leaves the rate to its reader, a tick is a second.
  const double frame = animation.mTicksPerSecond > kMinRate_hz ? 1.0 : 1.0 / kUsualRate_hz;
  std::map<double, unsigned> shared;
  unsigned moving = 0, sparse = 0;
  for (unsigned i = 0; i < animation.mNumChannels; ++i) {
    const aiNodeAnim& channel = *animation.mChannels[i];
    std::set<double> own;
    for (unsigned k = 0; k < channel.mNumPositionKeys; ++k)
      own.insert(channel.mPositionKeys[k].mTime);
    for (unsigned k = 0; k < channel.mNumRotationKeys; ++k)
      own.insert(channel.mRotationKeys[k].mTime);
    if (own.size() < 2) continue;
    ++moving;
    sparse += has_wide_gaps(channel, frame) ? 1 : 0;
    for (const double tick : own) ++shared[tick];
  }
  if (shared.empty()) return Ticks{};
  const double first = shared.begin()->first, last = shared.rbegin()->first;
  if (!std::isfinite(first) || !std::isfinite(last))
    return fail("has keys at no time; it is damaged");
  std::vector<double> ticks;
  for (const auto& [tick, channels] : shared) {
    if (2 * channels >= moving) ticks.push_back(tick);
  }
  const double step = (last - first) / std::max(static_cast<double>(ticks.size()) - 1.0, 1.0);
  bool even = ticks.size() > 2;
  for (std::size_t i = 0; even && i < ticks.size(); ++i) {
    even = std::abs(ticks[i] - first - static_cast<double>(i) * step) < 0.05 * step;
  }
  if (even && step < kSparse * frame) return Ticks{.at = std::move(ticks), .sparse = sparse > 0};
  if (!((last - first) / frame < static_cast<double>(kMaxNumbers))) {
    return fail("its animation is longer than a clip can be; cut it");
  }
  ticks.clear();
  for (std::size_t i = 0; first + static_cast<double>(i) * frame < last + 1e-6; ++i) {
    ticks.push_back(first + static_cast<double>(i) * frame);
  }
  return Ticks{.at = std::move(ticks), .sparse = sparse > 0};
}

// --- the .glb

class Builder {
 public:
  Builder(const aiScene& scene, std::vector<Node> nodes) : scene_(scene), nodes_(std::move(nodes)) {
    model_.asset.version = "2.0";
    model_.buffers.emplace_back();
  }

  Result<std::string> build() {
    add_nodes();
    for (unsigned i = 0; i < scene_.mNumAnimations; ++i) TRY(add_animation(*scene_.mAnimations[i]));
    add_skin();
    // tinygltf refuses to read a buffer without bytes.
    if (model_.buffers.front().data.empty()) model_.buffers.front().data.resize(4);
    std::ostringstream out;
    if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, out, false, true)) {
      return fail("holds something that cannot be told to posed; export it again");
    }
    return std::move(out).str();
  }

 private:
  void add_nodes();
  Result<> add_animation(const aiAnimation& animation);
  void add_skin();
  [[nodiscard]] std::string remark_of(const std::set<int>& moving, bool sparse) const;
  [[nodiscard]] std::map<std::string, int> numbers_of_names() const;
  [[nodiscard]] std::vector<std::optional<Eigen::Matrix4d>> bound(
      const std::vector<Eigen::Matrix4d>& world) const;
  [[nodiscard]] std::set<int> bones() const;

  const aiScene& scene_;
  std::vector<Node> nodes_;
  std::set<int> animated_;
  tinygltf::Model model_;
};

std::map<std::string, int> Builder::numbers_of_names() const {
  std::map<std::string, int> numbers;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    numbers.emplace(nodes_[n].name, static_cast<int>(n));
  }
  return numbers;
}

// Where the meshes were bound to their bones, in the world; where the figure stands in the file is
// often only where its author left it. Empty for a bone of no mesh, and for all of them where the
// sizes contradict the nodes'.
std::vector<std::optional<Eigen::Matrix4d>> Builder::bound(
    const std::vector<Eigen::Matrix4d>& world) const {
  std::vector<std::optional<Eigen::Matrix4d>> bound(nodes_.size());
  const auto by_name = numbers_of_names();
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const aiNode& node = *nodes_[n].parts.back();
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[m]];
      for (unsigned b = 0; b < mesh.mNumBones; ++b) {
        const auto bone = by_name.find(text_of(mesh.mBones[b]->mName));
        if (bone == by_name.end()) continue;
        const auto index = static_cast<std::size_t>(bone->second);
        const Eigen::Matrix4d at = world[n] * matrix_of(mesh.mBones[b]->mOffsetMatrix).inverse();
        constexpr double kSameSize = 0.01;
        const Eigen::Vector3d size = world[index].topLeftCorner<3, 3>().colwise().norm();
        const Eigen::Vector3d bound_size = at.topLeftCorner<3, 3>().colwise().norm();
        if (!at.allFinite() || !((bound_size - size).norm() < kSameSize * size.norm())) {
          return std::vector<std::optional<Eigen::Matrix4d>>(nodes_.size());
        }
        if (!bound[index]) bound[index] = at;
      }
    }
  }
  return bound;
}

void Builder::add_nodes() {
  std::vector<Eigen::Matrix4d> own, world;
  const auto above = [&](std::size_t n) {
    return nodes_[n].parent < 0 ? Eigen::Matrix4d(Eigen::Matrix4d::Identity())
                                : world[static_cast<std::size_t>(nodes_[n].parent)];
  };
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    own.push_back(nodes_[n].parent < 0 ? Eigen::Matrix4d(to_metres(scene_) * nodes_[n].rest())
                                       : nodes_[n].rest());
    world.push_back(above(n) * own[n]);
  }
  const auto bound_at = bound(world);
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    if (bound_at[n]) own[n] = above(n).inverse() * *bound_at[n];
    world[n] = above(n) * own[n];
    const int index = static_cast<int>(n);
    tinygltf::Node node;
    node.name = clean(nodes_[n].name);
    node.matrix.assign(own[n].data(), own[n].data() + own[n].size());
    if (nodes_[n].parent >= 0) {
      model_.nodes[static_cast<std::size_t>(nodes_[n].parent)].children.push_back(index);
    }
    model_.nodes.push_back(std::move(node));
  }
}

Result<> Builder::add_animation(const aiAnimation& from) {
  const Channels channels = channels_of(from);
  const auto times = TRY(ticks_of(from));
  const std::vector<double>& ticks = times.at;
  const double rate_hz = from.mTicksPerSecond;
  std::vector<float> time_s;
  time_s.reserve(ticks.size());
  for (const double tick : ticks) {
    time_s.push_back(static_cast<float>((tick - ticks.front()) / rate_hz));
  }
  tinygltf::Animation animation;
  animation.name = clean(text_of(from.mName));
  std::set<int> moving;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    if (moves(nodes_[n], channels)) moving.insert(static_cast<int>(n));
  }
  if (moving.empty()) return {};  // Mixamo's "Take 001"
  if (moving.size() * ticks.size() > kMaxNumbers / 7) {
    return fail("its animation is longer than a clip can be; cut it");
  }
  const int keys = clip::add_accessor(model_, time_s, TINYGLTF_TYPE_SCALAR);
  for (const int n : moving) {
    std::vector<float> places, turns;
    Eigen::Quaterniond before = Eigen::Quaterniond::Identity();
    for (const double tick : ticks) {
      const Eigen::Matrix4d local = local_at(nodes_[static_cast<std::size_t>(n)], channels, tick);
      const Eigen::Vector3d place = local.topRightCorner<3, 1>();
      Eigen::Quaterniond turn(Eigen::Matrix3d(local.topLeftCorner<3, 3>().colwise().normalized()));
      if (before.dot(turn) < 0.0) turn.coeffs() *= -1.0;
      before = turn;
      for (const double x : place) places.push_back(static_cast<float>(x));
      for (const double x : turn.coeffs()) turns.push_back(static_cast<float>(x));
    }
    clip::add_track(model_, animation, keys, n, "translation", places, TINYGLTF_TYPE_VEC3);
    clip::add_track(model_, animation, keys, n, "rotation", turns, TINYGLTF_TYPE_VEC4);
  }
  if (const std::string remark = remark_of(moving, times.sparse); !remark.empty()) {
    animation.extras =
        tinygltf::Value(tinygltf::Value::Object{{clip::kGltfRemark, tinygltf::Value(remark)}});
  }
  animated_.merge(moving);
  model_.animations.push_back(std::move(animation));
  return {};
}

// What assimp does not tell: which of two joints of one name moves, and which curve lies between
// keys.
std::string Builder::remark_of(const std::set<int>& moving, bool sparse) const {
  const std::string gaps =
      sparse ? "has keys frames apart, between which posed goes straight; if the program that wrote"
               " it draws curves, bake every frame there and export again"
             : "";
  std::set<std::string> names;
  for (const int n : moving) {
    const Node& node = nodes_[static_cast<std::size_t>(n)];
    if (!node.limb || names.insert(node.name).second) continue;
    return "has two joints named " + in_quotes(node.name) +
           ", whose motions posed cannot tell apart: they may be mixed. Give each figure names of"
           " its own, or export one alone" +
           (gaps.empty() ? "" : "; it also " + gaps);
  }
  return gaps;
}

std::set<int> Builder::bones() const {
  const auto by_name = numbers_of_names();
  std::set<int> bones;
  for (unsigned m = 0; m < scene_.mNumMeshes; ++m) {
    for (unsigned b = 0; b < scene_.mMeshes[m]->mNumBones; ++b) {
      const auto bone = by_name.find(text_of(scene_.mMeshes[m]->mBones[b]->mName));
      if (bone != by_name.end()) bones.insert(bone->second);
    }
  }
  const auto add_limbs = [&](const auto& counts) {
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].limb && counts(static_cast<int>(n))) bones.insert(static_cast<int>(n));
    }
  };
  if (bones.empty()) add_limbs([&](int n) { return animated_.contains(n); });
  if (bones.empty()) add_limbs([](int) { return true; });
  // Parents come first, so this reaches everything below a bone: tips, and joints without weights.
  add_limbs([&](int n) { return bones.contains(nodes_[static_cast<std::size_t>(n)].parent); });
  return bones;
}

void Builder::add_skin() {
  const auto joints = bones();
  if (joints.empty()) return;
  tinygltf::Skin skin;
  skin.joints.assign(joints.begin(), joints.end());
  model_.skins.push_back(std::move(skin));
}

}  // namespace

Result<std::string> glb_of_fbx(std::string_view bytes) {
  try {
    Assimp::Importer importer;
    const auto scene = TRY(load(importer, bytes));
    auto nodes = TRY(nodes_of(*scene));
    return Builder(*scene, std::move(nodes)).build();
  } catch (const std::bad_alloc&) {
    return fail(
        "needs more memory than a file of its length may take; export the figure without its "
        "meshes");
  } catch (const std::exception& thrown) {
    return fail("is no FBX that can be read (" + clean(thrown.what()) + ")");
  }
}

}  // namespace posed::fbx
