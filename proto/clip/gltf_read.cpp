// Reads glTF 2.0 (.glb, .gltf) and its VRM dialects (.vrm, .vrma) as a clip: the bones of a VRM
// humanoid, or the joints of the skins, with the first animation; without one the figure as it
// rests. A node of glTF has a rotation at rest, a joint of a clip has none: with G_j and W_j the
// world rotation of node j now and at rest, the joint's is G'_j = G_j W_j^-1, and L'_j =
// G'_parent^-1 G'_j. So the zero pose of the clip's figure is the file's rest pose.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tiny_gltf.h>

#include "proto/clip/draft.hpp"
#include "proto/clip/formats.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxFigure = 1000;         // joints
constexpr std::size_t kMaxNumbers = 50'000'000;  // of all frames
constexpr std::size_t kMaxSteps = 100'000'000;   // poses and tracks of all frames
constexpr std::size_t kMaxValues = 1'000'000;    // of the JSON; each takes 0.3 KB of memory
constexpr std::size_t kMaxNesting = 100;           // of the JSON; tinygltf calls itself
constexpr std::size_t kMaxWhy = 200;             // letters of what tinygltf says
constexpr double kMaxFramesAKey = 1000.0;        // so that a short file asks for little work
constexpr double kStillRate_hz = 30.0;           // of a file without an animation
constexpr double kUnevenRate_hz = 60.0;          // of one whose keys have no rate
constexpr double kMaxKeyRate_hz = 1000.0;

// --- what tinygltf may do

bool skip_image(tinygltf::Image* /*image*/, int /*index*/, std::string* /*error*/,
                std::string* /*warning*/, int /*width*/, int /*height*/,
                const unsigned char* /*bytes*/, int /*size*/, void* /*user*/) {
  return true;
}
bool never_exists(const std::string& /*path*/, void* /*user*/) { return false; }
std::string same_path(const std::string& path, void* /*user*/) { return path; }
bool never_reads(std::vector<unsigned char>* /*out*/, std::string* error, const std::string& path,
                 void* /*user*/) {
  *error = "keeps a part of itself in another file (" + clean(path) + "); export it as .glb";
  return false;
}

// The JSON of a .gltf or .glb; a damaged .glb is left to tinygltf.
std::string_view json_of(std::string_view bytes) {
  constexpr std::size_t kSizeAt = 12, kJsonAt = 20;
  if (!bytes.starts_with("glTF")) return bytes;
  if (bytes.size() < kJsonAt) return {};
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data() + kSizeAt, sizeof size);
  return bytes.substr(kJsonAt, size);
}

// Whether tinygltf can read the JSON with bounded stack and memory.
Result<> check_json(std::string_view json) {
  std::size_t depth = 0, values = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      in_text = c != '"';
      continue;
    }
    in_text = c == '"';
    if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      depth -= depth > 0 ? 1 : 0;
    } else if (c != ',') {
      continue;
    }
    ++values;
    if (depth > kMaxNesting) return fail("is nested too deeply to be a glTF");
    if (values > kMaxValues) return fail("has too much in its JSON to be a figure");
  }
  return {};
}

Result<tinygltf::Model> load_model(const ClipFile& file) {
  if (const auto fits = check_json(json_of(file.bytes)); !fits) {
    return fail(fits.error().message, file.name);
  }
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(skip_image, nullptr);
  loader.SetFsCallbacks({.FileExists = never_exists,
                         .ExpandFilePath = same_path,
                         .ReadWholeFile = never_reads,
                         .WriteWholeFile = nullptr,
                         .user_data = nullptr});
  if (file.bytes.size() > std::numeric_limits<int>::max()) {
    return fail("is longer than the 2 GB that a glTF file can have", file.name);
  }
  tinygltf::Model model;
  std::string error, warning;
  const auto size = static_cast<unsigned>(file.bytes.size());
  bool loaded = false;
  try {
    if (file.bytes.starts_with("glTF")) {
      const auto* bytes = reinterpret_cast<const unsigned char*>(file.bytes.data());
      loaded = loader.LoadBinaryFromMemory(&model, &error, &warning, bytes, size);
    } else {
      loaded = loader.LoadASCIIFromString(&model, &error, &warning, file.bytes.data(), size, "");
    }
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (loaded) return model;
  const std::string why = clean(error.substr(0, std::min(error.find('\n'), kMaxWhy)));
  return fail("is no glTF that can be read" + (why.empty() ? "" : " (" + why + ")"), file.name);
}

// --- numbers

double number_at(const unsigned char* at, int type, bool normalized) {
  const auto read = [at]<typename Value>(Value value) {
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  };
  const auto scaled = [normalized](double value, double most) {
    return normalized ? std::max(value / most, -1.0) : value;
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return scaled(read(std::int8_t{}), 127.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return scaled(read(std::uint8_t{}), 255.0);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return scaled(read(std::int16_t{}), 32767.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return scaled(read(std::uint16_t{}), 65535.0);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return read(float{});
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

// All numbers of an accessor with so many components an entry; empty if it is damaged, sparse, or
// has a value that is none.
std::vector<double> numbers_of(const tinygltf::Model& model, int index, int components) {
  if (index < 0 || index >= std::ssize(model.accessors)) return {};
  const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(index)];
  const int view_index = accessor.bufferView;
  if (accessor.sparse.isSparse || view_index < 0 || view_index >= std::ssize(model.bufferViews) ||
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components) {
    return {};
  }
  const auto& view = model.bufferViews[static_cast<std::size_t>(view_index)];
  if (view.buffer < 0 || view.buffer >= std::ssize(model.buffers)) return {};
  const auto& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  const int stride = accessor.ByteStride(view);
  const int part =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  if (stride <= 0 || part <= 0 || accessor.count == 0 || accessor.count > kMaxNumbers) return {};
  const std::size_t begin = view.byteOffset + accessor.byteOffset;
  const std::size_t last = begin + (accessor.count - 1) * static_cast<std::size_t>(stride);
  const auto entry = static_cast<std::size_t>(components) * static_cast<std::size_t>(part);
  if (begin < view.byteOffset || last > data.size() || data.size() - last < entry) return {};
  std::vector<double> numbers;
  numbers.reserve(accessor.count * static_cast<std::size_t>(components));
  for (std::size_t i = 0; i < accessor.count; ++i) {
    const unsigned char* at = data.data() + begin + i * static_cast<std::size_t>(stride);
    for (int c = 0; c < components; ++c) {
      numbers.push_back(number_at(at + c * part, accessor.componentType, accessor.normalized));
      if (!std::isfinite(numbers.back())) return {};
    }
  }
  return numbers;
}

// --- the tree of nodes

struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
};

Pose pose_of(const tinygltf::Node& node) {
  Pose pose;
  if (node.matrix.size() == 16) {
    const Eigen::Map<const Eigen::Matrix4d> matrix(node.matrix.data());
    const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
    pose.position = matrix.topRightCorner<3, 1>();
    pose.scale = turn.colwise().norm();
    if ((pose.scale.array() > 0.0).all()) {
      pose.rotation =
          Eigen::Quaterniond(Eigen::Matrix3d(turn * pose.scale.cwiseInverse().asDiagonal()));
    }
  }
  if (node.translation.size() == 3) pose.position = Eigen::Vector3d(node.translation.data());
  if (node.rotation.size() == 4) pose.rotation = Eigen::Quaterniond(node.rotation.data());
  if (node.scale.size() == 3) pose.scale = Eigen::Vector3d(node.scale.data());
  pose.rotation =
      pose.rotation.norm() > 0.0 ? pose.rotation.normalized() : Eigen::Quaterniond::Identity();
  return pose;
}

struct Tree {
  std::vector<int> parent;  // [node]; -1: none
  std::vector<int> order;   // the nodes, parents first; nodes of a circle are left out
};

Tree tree_of(const tinygltf::Model& model) {
  const std::size_t count = model.nodes.size();
  Tree tree{.parent = std::vector<int>(count, -1), .order = {}};
  for (std::size_t n = 0; n < count; ++n) {
    for (const int child : model.nodes[n].children) {
      if (child < 0 || child >= std::ssize(model.nodes)) continue;
      int& parent = tree.parent[static_cast<std::size_t>(child)];
      if (parent < 0) parent = static_cast<int>(n);
    }
  }
  std::vector<int> open;
  std::vector<bool> seen(count, false);  // a node may be named twice among the children
  for (std::size_t n = count; n-- > 0;) {
    if (tree.parent[n] < 0) open.push_back(static_cast<int>(n));
  }
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    if (seen[static_cast<std::size_t>(node)]) continue;
    seen[static_cast<std::size_t>(node)] = true;
    tree.order.push_back(node);
    const auto& children = model.nodes[static_cast<std::size_t>(node)].children;
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      if (*child >= 0 && *child < std::ssize(model.nodes) &&
          tree.parent[static_cast<std::size_t>(*child)] == node) {
        open.push_back(*child);
      }
    }
  }
  return tree;
}

// Sets the world poses of the nodes in the tree's order from their own. Scales go into places only.
void place(const Tree& tree, const std::vector<Pose>& own, std::vector<Pose>& world) {
  for (const int node : tree.order) {
    const auto n = static_cast<std::size_t>(node);
    world[n] = own[n];
    if (tree.parent[n] < 0) continue;
    const Pose& above = world[static_cast<std::size_t>(tree.parent[n])];
    world[n].position = above.position + above.rotation * above.scale.cwiseProduct(own[n].position);
    world[n].rotation = (above.rotation * own[n].rotation).normalized();
    world[n].scale = above.scale.cwiseProduct(own[n].scale);
  }
}

// Without the nodes that are neither among `nodes` nor above them.
Tree needed_of(Tree tree, const std::vector<int>& nodes) {
  std::vector<bool> needed(tree.parent.size(), false);
  for (int node : nodes) {
    for (; node >= 0 && !needed[static_cast<std::size_t>(node)];
         node = tree.parent[static_cast<std::size_t>(node)]) {
      needed[static_cast<std::size_t>(node)] = true;
    }
  }
  std::erase_if(tree.order, [&](int node) { return !needed[static_cast<std::size_t>(node)]; });
  return tree;
}

// --- the figure

// The humanoid's bones by their nodes, of VRM 0, VRM 1 or a VRM animation.
struct Humanoid {
  std::map<int, Bone> bones;
  bool backwards = false;  // VRM 0 looks along -Z
};

// A null value where there is none.
const tinygltf::Value& member(const tinygltf::Value& object, const std::string& name) {
  static const tinygltf::Value kNone;
  return object.IsObject() ? object.Get(name) : kNone;
}

Humanoid humanoid_of(const tinygltf::Model& model) {
  Humanoid found;
  const auto add = [&](std::string name, const tinygltf::Value& node, bool old_thumbs) {
    if (!node.IsInt()) return;
    if (old_thumbs && name.find("Thumb") != std::string::npos) {
      const auto replace = [&name](std::string_view from, std::string_view to) {
        const std::size_t at = name.find(from);
        if (at == std::string::npos) return false;
        name.replace(at, from.size(), to);
        return true;
      };
      static_cast<void>(replace("Proximal", "Metacarpal") || replace("Intermediate", "Proximal"));
    }
    if (const auto bone = bone_from_name(name)) {
      found.bones.emplace(node.GetNumberAsInt(), *bone);
    }
  };
  for (const char* extension : {"VRMC_vrm", "VRMC_vrm_animation", "VRM"}) {
    const auto at = model.extensions.find(extension);
    if (at == model.extensions.end() || !at->second.Has("humanoid")) continue;
    const tinygltf::Value& bones = member(member(at->second, "humanoid"), "humanBones");
    if (bones.IsArray()) {
      for (std::size_t i = 0; i < bones.ArrayLen(); ++i) {
        const tinygltf::Value& entry = bones.Get(static_cast<int>(i));
        if (!member(entry, "bone").IsString()) continue;
        add(entry.Get("bone").Get<std::string>(), entry.Get("node"), true);
      }
      found.backwards = true;
    } else if (bones.IsObject()) {
      for (const std::string& name : bones.Keys())
        add(name, member(bones.Get(name), "node"), false);
    }
    if (!found.bones.empty()) return found;
  }
  return found;
}

struct Figure {
  std::map<int, int> tips;   // the node at the end of a joint that has nothing else below it
  std::vector<int> nodes;    // [joint], parents first
  std::vector<int> parents;  // [joint]
  std::vector<std::optional<Bone>> bones;  // [joint] that the file names; empty: it names none
};

// The nodes that count: a humanoid's, the skins' joints, those that an animation turns, or all.
std::set<int> chosen_nodes(const tinygltf::Model& model, const Humanoid& humanoid) {
  std::set<int> chosen;
  const auto add = [&](int node) {
    if (node >= 0 && node < std::ssize(model.nodes)) chosen.insert(node);
  };
  for (const auto& [node, bone] : humanoid.bones) add(node);
  if (!chosen.empty()) return chosen;
  for (const tinygltf::Skin& skin : model.skins) std::ranges::for_each(skin.joints, add);
  if (!chosen.empty()) return chosen;
  if (!model.animations.empty()) {
    for (const auto& channel : model.animations.front().channels) add(channel.target_node);
  }
  if (!chosen.empty()) return chosen;
  for (int node = 0; node < std::ssize(model.nodes); ++node) add(node);
  return chosen;
}

// Blender and posed write the end of a leaf bone as a node of its own.
bool is_tip(const tinygltf::Model& model, int node, int parent) {
  const tinygltf::Node& at = model.nodes[static_cast<std::size_t>(node)];
  return at.children.empty() &&
         at.name == model.nodes[static_cast<std::size_t>(parent)].name + "_end";
}

// The part of the tree that has the chosen nodes: from the node below which all of them are, or
// most where they have no such node, without branches that have none.
Figure figure_of(const tinygltf::Model& model, const Tree& tree, const std::set<int>& chosen,
                 const Humanoid& humanoid) {
  std::vector<int> below(tree.parent.size(), 0);  // chosen nodes at and below
  for (auto node = tree.order.rbegin(); node != tree.order.rend(); ++node) {
    const auto n = static_cast<std::size_t>(*node);
    if (chosen.contains(*node)) ++below[n];
    if (tree.parent[n] >= 0) below[static_cast<std::size_t>(tree.parent[n])] += below[n];
  }
  const int most = below.empty() ? 0 : *std::ranges::max_element(below);
  int root = -1;
  for (const int node : tree.order) {
    const auto n = static_cast<std::size_t>(node);
    if (below[n] == most && (root < 0 || tree.parent[n] == root)) root = node;
  }
  Figure figure;
  std::map<int, int> joint_of;
  for (const int node : tree.order) {
    const auto n = static_cast<std::size_t>(node);
    const auto above = joint_of.find(tree.parent[n]);
    if (node != root && (above == joint_of.end() || below[n] == 0)) continue;
    if (node != root && is_tip(model, node, tree.parent[n])) {
      figure.tips[above->second] = node;
      continue;
    }
    joint_of[node] = static_cast<int>(figure.nodes.size());
    figure.nodes.push_back(node);
    figure.parents.push_back(node == root ? -1 : above->second);
    if (humanoid.bones.empty()) continue;
    const auto bone = humanoid.bones.find(node);
    figure.bones.push_back(bone == humanoid.bones.end() ? std::nullopt
                                                        : std::optional(bone->second));
  }
  return figure;
}

// --- the animation

struct Track {
  int node = 0;
  enum class Path : std::uint8_t { kPosition, kRotation } path = Path::kPosition;
  enum class Between : std::uint8_t { kLine, kStep, kCubic } between = Between::kLine;
  std::span<const double> time_s{}, values{};

  [[nodiscard]] int width() const { return path == Path::kRotation ? 4 : 3; }
  // The k-th part of the i-th key: of a cubic one 0 is the tangent in, 1 the value, 2 the tangent
  // out.
  [[nodiscard]] Eigen::Vector4d key(std::size_t i, std::size_t part) const {
    const std::size_t parts = between == Between::kCubic ? 3 : 1;
    const double* at =
        values.data() + (i * parts + (parts == 3 ? part : 0)) * static_cast<std::size_t>(width());
    return {at[0], at[1], at[2], width() == 4 ? at[3] : 0.0};
  }
  [[nodiscard]] Eigen::Vector4d at(double time) const;
};

Eigen::Vector4d Track::at(double time) const {
  const auto next = std::ranges::upper_bound(time_s, time);
  if (next == time_s.begin()) return key(0, 1);
  const auto i = static_cast<std::size_t>(next - time_s.begin()) - 1;
  if (next == time_s.end() || between == Between::kStep) return key(i, 1);
  const double span_s = time_s[i + 1] - time_s[i];
  const double t = span_s > 0.0 ? (time - time_s[i]) / span_s : 0.0;
  const Eigen::Vector4d a = key(i, 1), b = key(i + 1, 1);
  if (between == Between::kCubic) {
    const double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * a + span_s * (t3 - 2 * t2 + t) * key(i, 2) +
           (3 * t2 - 2 * t3) * b + span_s * (t3 - t2) * key(i + 1, 0);
  }
  if (path == Path::kPosition) return a + t * (b - a);
  return Eigen::Quaterniond(a).slerp(t, Eigen::Quaterniond(b)).coeffs();
}

// The numbers of accessors, each read once however many channels name it, and no more than the
// file has bytes for: accessors may overlap.
class Numbers {
 public:
  explicit Numbers(const tinygltf::Model& model) : model_(model) {
    for (const tinygltf::Buffer& buffer : model.buffers) left_ += buffer.data.size();
  }
  // As numbers_of().
  std::span<const double> of(int index, int components) {
    const auto [place, is_new] = read_.try_emplace({index, components});
    if (!is_new) return place->second;
    if (index >= 0 && index < std::ssize(model_.accessors)) {
      const std::size_t count = model_.accessors[static_cast<std::size_t>(index)].count;
      if (count > left_ / static_cast<std::size_t>(components)) return {};
    }
    place->second = numbers_of(model_, index, components);
    left_ -= place->second.size();
    return place->second;
  }

 private:
  const tinygltf::Model& model_;
  std::map<std::pair<int, int>, std::vector<double>> read_;
  std::size_t left_ = 0;
};

Result<std::vector<Track>> tracks_of(const tinygltf::Model& model, const Tree& needed,
                                     Numbers& numbers) {
  std::vector<Track> tracks;
  if (model.animations.empty()) return tracks;
  const std::set<int> turned(needed.order.begin(), needed.order.end());
  const tinygltf::Animation& animation = model.animations.front();
  for (const tinygltf::AnimationChannel& channel : animation.channels) {
    const bool turns = channel.target_path == "rotation";
    if (!turns && channel.target_path != "translation") continue;
    if (!turned.contains(channel.target_node)) continue;
    if (channel.sampler < 0 || channel.sampler >= std::ssize(animation.samplers)) {
      return fail("a channel of its animation has no sampler; it is damaged");
    }
    const auto& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
    Track track{.node = channel.target_node,
                .path = turns ? Track::Path::kRotation : Track::Path::kPosition};
    if (sampler.interpolation == "STEP") track.between = Track::Between::kStep;
    if (sampler.interpolation == "CUBICSPLINE") track.between = Track::Between::kCubic;
    track.time_s = numbers.of(sampler.input, 1);
    track.values = numbers.of(sampler.output, track.width());
    const std::size_t parts = track.between == Track::Between::kCubic ? 3 : 1;
    const std::size_t wanted =
        track.time_s.size() * parts * static_cast<std::size_t>(track.width());
    if (track.time_s.empty() || track.values.size() != wanted ||
        !std::ranges::is_sorted(track.time_s)) {
      return fail("the keys of node " + std::to_string(channel.target_node) +
                  " are damaged, or packed in a way that posed does not read (sparse)");
    }
    tracks.push_back(track);
  }
  return tracks;
}

// Evenly spaced times that hit the keys of the track that has most, if those have a rate.
struct Times {
  double rate_hz = kStillRate_hz;
  double first_s = 0.0;
  std::size_t frames = 1;
};

Times times_of(const std::vector<Track>& tracks) {
  Times times;
  const Track* densest = nullptr;
  double last_s = 0.0;
  for (const Track& track : tracks) {
    if (densest == nullptr || track.time_s.size() > densest->time_s.size()) densest = &track;
    times.first_s = densest == &track && &track == tracks.data()
                        ? track.time_s.front()
                        : std::min(times.first_s, track.time_s.front());
    last_s = std::max(last_s, track.time_s.back());
  }
  if (densest == nullptr || last_s <= times.first_s) return times;
  const std::span<const double> keys = densest->time_s;
  const auto steps = static_cast<double>(keys.size() - 1);
  const double span_s = keys.back() - keys.front();
  const double rate_hz = span_s > 0.0 ? steps / span_s : 0.0;
  bool even = keys.size() > 2 && rate_hz >= 1.0 && rate_hz <= kMaxKeyRate_hz;
  for (std::size_t i = 0; even && i < keys.size(); ++i) {
    constexpr double kNear = 0.05;  // of a frame
    even = std::abs((keys[i] - keys.front()) * rate_hz - static_cast<double>(i)) < kNear;
  }
  const double whole_hz = std::round(rate_hz);
  times.rate_hz = !even                                            ? kUnevenRate_hz
                  : std::abs(rate_hz - whole_hz) < 1e-4 * whole_hz ? whole_hz
                                                                   : rate_hz;
  const double frames = (last_s - times.first_s) * times.rate_hz + 1e-6;
  times.frames = frames < kMaxFramesAKey * (steps + 1.0) ? static_cast<std::size_t>(frames) + 1
                                                         : std::numeric_limits<std::size_t>::max();
  return times;
}

// Those that gltf.cpp writes: a frame has that of the newest key. Empty for other files.
std::vector<Timecode> timecodes_of(const tinygltf::Model& model, const std::vector<Track>& tracks,
                                   const Times& times) {
  if (model.animations.empty() || tracks.empty()) return {};
  const tinygltf::Value& extras = model.animations.front().extras;
  if (!extras.IsObject() || !extras.Has("timecodes")) return {};
  const tinygltf::Value& keys = extras.Get("timecodes");
  const std::span<const double> key_s = tracks.front().time_s;
  if (!keys.IsArray() || keys.ArrayLen() != key_s.size()) return {};
  std::vector<Timecode> out;
  for (std::size_t i = 0; i < times.frames; ++i) {
    constexpr double kNear_s = 1e-4;  // the keys' times are floats
    const double time_s = times.first_s + static_cast<double>(i) / times.rate_hz + kNear_s;
    const auto next = std::ranges::upper_bound(key_s, time_s) - key_s.begin();
    const tinygltf::Value& code = keys.Get(static_cast<int>(std::max(next - 1, std::ptrdiff_t{0})));
    out.push_back(code.IsString() ? to_timecode(code.Get<std::string>()) : Timecode{});
  }
  return out;
}

// --- the clip

class Reader {
 public:
  Reader(const tinygltf::Model& model, const ClipFile& file)
      : model_(model), file_(file), tree_(tree_of(model)) {
    for (const tinygltf::Node& node : model.nodes) rest_.push_back(pose_of(node));
  }

  Result<Draft> read();

 private:
  [[nodiscard]] bool moves(std::size_t joint, const std::vector<Track>& tracks) const;
  void describe(const std::vector<Track>& tracks, Draft& draft) const;
  void add_frame(const std::vector<Pose>& world, std::vector<std::array<double, 3>>& near,
                 Draft& draft) const;

  const tinygltf::Model& model_;
  const ClipFile& file_;
  Tree tree_;
  std::vector<Pose> rest_;  // [node], of its own
  Humanoid humanoid_;
  Figure figure_;
  std::vector<Pose> world_rest_;  // [node]
  Eigen::Quaterniond forwards_ = Eigen::Quaterniond::Identity();
};

// Whether a joint changes its distance from its parent, as hips below a root do.
bool Reader::moves(std::size_t joint, const std::vector<Track>& tracks) const {
  constexpr double kStill_m = 0.001;
  if (joint == 0) return true;
  const int above = figure_.nodes[static_cast<std::size_t>(figure_.parents[joint])];
  const double scale = world_rest_[static_cast<std::size_t>(above)].scale.cwiseAbs().maxCoeff();
  return std::ranges::any_of(tracks, [&](const Track& track) {
    if (track.node != figure_.nodes[joint] || track.path != Track::Path::kPosition) return false;
    for (std::size_t i = 1; i < track.time_s.size(); ++i) {
      if ((track.key(i, 1) - track.key(0, 1)).norm() * scale > kStill_m) return true;
    }
    return false;
  });
}

void Reader::describe(const std::vector<Track>& tracks, Draft& draft) const {
  Skeleton& skeleton = draft.skeleton;
  skeleton.name = std::filesystem::path(file_.name).stem().string();
  std::map<std::string, int> names;
  for (std::size_t j = 0; j < figure_.nodes.size(); ++j) {
    const auto n = static_cast<std::size_t>(figure_.nodes[j]);
    Joint& joint = skeleton.joints.emplace_back();
    joint.name = clean(model_.nodes[n].name);
    if (joint.name.empty()) joint.name = "node" + std::to_string(n);
    if (const int others = names[joint.name]++; others > 0) {
      joint.name += "-" + std::to_string(others + 1);
    }
    joint.parent = figure_.parents[j];
    Eigen::Vector3d place = world_rest_[n].position;
    if (joint.parent >= 0) {
      const int above = figure_.nodes[static_cast<std::size_t>(joint.parent)];
      place -= world_rest_[static_cast<std::size_t>(above)].position;
    }
    joint.offset_m = forwards_ * place;
    if (const auto tip = figure_.tips.find(static_cast<int>(j)); tip != figure_.tips.end()) {
      const Pose& end = world_rest_[static_cast<std::size_t>(tip->second)];
      joint.end_site_m = forwards_ * (end.position - world_rest_[n].position);
    }
    const auto index = static_cast<std::uint16_t>(j);
    const bool moving = moves(j, tracks);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      if (moving) {
        skeleton.channels.push_back({.joint = index, .axis = axis, .translation = true});
      }
    }
    for (const Axis axis : {Axis::kZ, Axis::kY, Axis::kX}) {
      skeleton.channels.push_back({.joint = index, .axis = axis});
    }
  }
}

void Reader::add_frame(const std::vector<Pose>& world, std::vector<std::array<double, 3>>& near,
                       Draft& draft) const {
  std::vector<Eigen::Quaterniond> turned(figure_.nodes.size());
  for (std::size_t j = 0; j < figure_.nodes.size(); ++j) {
    const auto n = static_cast<std::size_t>(figure_.nodes[j]);
    turned[j] =
        forwards_ * world[n].rotation * world_rest_[n].rotation.conjugate() * forwards_.conjugate();
    Eigen::Vector3d place = forwards_ * world[n].position;
    Eigen::Quaterniond local = turned[j];
    if (figure_.parents[j] >= 0) {
      const auto parent = static_cast<std::size_t>(figure_.parents[j]);
      const auto above = static_cast<std::size_t>(figure_.nodes[parent]);
      place = turned[parent].conjugate() * (place - forwards_ * world[above].position);
      local = turned[parent].conjugate() * turned[j];
    }
    if (channels_of(draft.skeleton, static_cast<int>(j)).front().translation) {
      draft.values.insert(draft.values.end(), {place.x(), place.y(), place.z()});
    }
    near[j] = channels_from_rotation(draft.skeleton, static_cast<int>(j), local, near[j]);
    draft.values.insert(draft.values.end(), near[j].begin(), near[j].end());
  }
}

Result<Draft> Reader::read() {
  if (model_.nodes.empty()) return fail("has no nodes, so there is no figure in it");
  if (model_.nodes.size() > kMaxNodes) return fail("has too many nodes to be a figure");
  humanoid_ = humanoid_of(model_);
  if (humanoid_.backwards)
    forwards_ = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY());
  figure_ = figure_of(model_, tree_, chosen_nodes(model_, humanoid_), humanoid_);
  if (figure_.nodes.empty()) return fail("its nodes go in a circle; it is damaged");
  if (figure_.nodes.size() > kMaxFigure) {
    return fail("has a figure of more than " + std::to_string(kMaxFigure) + " joints");
  }
  world_rest_.resize(rest_.size());
  place(tree_, rest_, world_rest_);
  tree_ = needed_of(std::move(tree_), figure_.nodes);
  Numbers numbers(model_);
  const auto tracks = TRY(tracks_of(model_, tree_, numbers));
  const Times times = times_of(tracks);
  Draft draft;
  describe(tracks, draft);
  draft.bones = figure_.bones;
  draft.rests_in_t = !humanoid_.bones.empty();
  draft.frame_rate_hz = times.rate_hz;
  if (times.frames > kMaxNumbers / draft.skeleton.channels.size() ||
      times.frames > kMaxSteps / (tree_.order.size() + tracks.size())) {
    return fail("its animation is longer than a clip can be; cut it");
  }
  if (model_.animations.empty()) {
    draft.warnings.emplace_back("has no animation; its rest pose is the only frame");
  } else if (model_.animations.size() > 1) {
    draft.warnings.push_back("has " + std::to_string(model_.animations.size()) +
                             " animations; the first one is read");
  }
  draft.timecode = timecodes_of(model_, tracks, times);
  std::vector<std::array<double, 3>> near(figure_.nodes.size());
  std::vector<Pose> own = rest_, world = world_rest_;
  for (std::size_t i = 0; i < times.frames; ++i) {
    const double time_s = times.first_s + static_cast<double>(i) / times.rate_hz;
    for (const Track& track : tracks) {
      Pose& pose = own[static_cast<std::size_t>(track.node)];
      const Eigen::Vector4d value = track.at(time_s);
      if (track.path == Track::Path::kPosition) {
        pose.position = value.head<3>();
      } else if (value.norm() > 0.0) {
        pose.rotation = Eigen::Quaterniond(value).normalized();
      }
    }
    place(tree_, own, world);
    add_frame(world, near, draft);
  }
  return draft;
}

}  // namespace

Result<Draft> read_gltf(const ClipFile& file, const ReadOptions& options) {
  const auto model = TRY(load_model(file));
  auto draft = Reader(model, file).read();
  if (!draft) return fail(draft.error().message, file.name);
  if (draft->bones.empty()) draft->profile = TRY(find_profile(draft->skeleton, options.profile));
  return draft;
}

// .vrm is an avatar: a figure without motion.
Format gltf_format() {
  return {.name = "glTF",
          .extensions = {".gltf", ".vrm"},
          .evenly_spaced = true,
          .options = {ReadOption::kProfile},
          .read = read_gltf};
}

}  // namespace posed::clip
