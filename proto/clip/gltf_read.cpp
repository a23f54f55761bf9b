// Reads glTF 2.0 (.glb, .gltf) and its VRM dialects (.vrm, .vrma) as a clip: the bones of a VRM
// humanoid, or the joints of the skins, with the first animation that moves them; without one the
// figure as it rests. A node of glTF has a rotation at rest, a joint of a clip has none: with G_j
// and W_j the world rotation of node j now and at rest, the joint's is G'_j = G_j W_j^-1, and L'_j
// = G'_parent^-1 G'_j. So the zero pose of the clip's figure is the file's rest pose; and where the
// nodes stand in some pose of the animation, as many programs leave them, it is the pose in which
// the skin was bound to them.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <tiny_gltf.h>

#include "proto/clip/draft.hpp"
#include "proto/clip/formats.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/clip/gltf_numbers.hpp"
#include "proto/clip/joint_names.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/median.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxFigure = 1000;         // joints
constexpr std::size_t kMaxNumbers = 50'000'000;  // of all frames
constexpr double kMaxFramesAKey = 1000.0;        // so that a short file asks for little work
constexpr double kFewFrames = 36'000.0;          // that any file may ask for: a pose held for long
constexpr double kStillRate_hz = 30.0;           // of a file without an animation
constexpr double kUnevenRate_hz = 60.0;          // least rate of one whose keys are uneven
constexpr double kMaxKeyRate_hz = 1000.0;
constexpr std::size_t kMaxAnimations = 100;  // that are searched for motion
constexpr std::size_t kMaxNesting = 100;     // of JSON: tinygltf calls itself
constexpr std::size_t kMaxValues = 450'000;  // of JSON, each 0.3 KB of memory: 100 animations
constexpr std::size_t kMaxCopied_bytes = 16'000'000;  // of a .glb's binary part
constexpr std::size_t kMaxSteps = 100'000'000;        // poses and tracks of all frames
constexpr std::size_t kMaxWhy = 200;                  // letters of what tinygltf says
// The extensions whose humanoid is read; the first that names bones counts.
constexpr std::array<std::string_view, 3> kExtensions{"VRMC_vrm", "VRMC_vrm_animation", "VRM"};

// --- what tinygltf may do

bool skip_image(tinygltf::Image* /*image*/, int /*index*/, std::string* /*error*/,
                std::string* /*warning*/, int /*width*/, int /*height*/,
                const unsigned char* /*bytes*/, int /*size*/, void* /*user*/) {
  return true;
}
// Lets tinygltf go on to never_reads(), whose error says what to do.
bool always_exists(const std::string& /*path*/, void* /*user*/) { return true; }
std::string same_path(const std::string& path, void* /*user*/) { return path; }
bool never_reads(std::vector<unsigned char>* /*out*/, std::string* error, const std::string& path,
                 void* /*user*/) {
  *error = "keeps a part of itself in another file (" + clean(path) + "); export it as .glb";
  return false;
}

constexpr std::size_t kGlbHeader = 20, kGlbLengthAt = 8, kGlbJsonLengthAt = 12;
std::uint32_t number_in(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}
// The JSON of a .glb is its first chunk; brackets in the bytes after that mean nothing.
std::string_view json_of(std::string_view bytes) {
  if (!bytes.starts_with("glTF") || bytes.size() < kGlbHeader) return bytes;
  return bytes.substr(kGlbHeader, number_in(bytes, kGlbJsonLengthAt));
}

// A whole number that is written with a point or an exponent, as JSON and glTF allow (3.0, 1e2),
// in digits alone; empty for any other word.
std::string whole_number(std::string_view word) {
  constexpr std::string_view kDigits = "0123456789";
  const std::string_view digits = word.substr(word.starts_with('-') ? 1 : 0);
  const std::size_t point = digits.find('.');
  const auto is_digit = [&](std::size_t at) {
    return at < digits.size() && kDigits.contains(digits[at]);
  };
  // No number of JSON, which from_chars() takes: 01.0, .5, 5.
  const bool is_json = is_digit(0) && !(digits[0] == '0' && is_digit(1)) &&
                       (point == digits.npos || is_digit(point + 1));
  if (!is_json) return {};
  constexpr double kMaxWhole = 9007199254740992.0;  // up to which a double has each whole number
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  if (word.find_first_of(".eE") == word.npos || std::abs(value) > kMaxWhole) return {};
  if (std::trunc(value) != value || (value == 0.0 && std::signbit(value))) return {};
  return std::to_string(static_cast<std::int64_t>(value));
}

// What posed reads of a glTF's JSON. The rest (meshes, materials, textures, what programs add for
// themselves) is cut out before tinygltf, which would take up to 3 KB for each empty material; and
// whole numbers get the one form that tinygltf takes for an index.
class JsonCut {
 public:
  explicit JsonCut(std::string_view json) : json_(json) {}

  // Puts 0 in place of each value that posed does not read. Fails if the rest would take tinygltf
  // too much stack or memory.
  Result<> cut() {
    while (at_ < json_.size()) {
      const char c = json_[at_];
      if (c == '"') {
        const std::string_view text = skip_text();
        if (skip_to_value() && !wanted(text)) blank_value();
        continue;
      }
      if (kNumber.contains(c)) {
        add_number();
        continue;
      }
      ++at_;
      if (c == '[' || c == '{') {
        ++depth_;
      } else if (c == ']' || c == '}') {
        depth_ -= depth_ > 0 ? 1 : 0;
      } else if (c != ',') {
        continue;
      }
      buffers_ += c == '{' && depth_ == 3 && top_ == "buffers" ? 1 : 0;
      if (depth_ > kMaxNesting) return fail("its JSON is nested too deep");
      if (++values_ > kMaxValues) {
        return fail("it describes too much; export the figure alone, with fewer animations");
      }
    }
    replace(at_, "");
    return {};
  }
  [[nodiscard]] const std::string& out() const { return out_; }
  [[nodiscard]] std::size_t buffers() const { return buffers_; }

 private:
  static constexpr std::string_view kNumber = "+-.0123456789eE";

  // The words stand for what has been read since `begin`.
  void replace(std::size_t begin, std::string_view words) {
    out_ += json_.substr(copied_, begin - copied_);
    out_ += words;
    copied_ = at_;
  }
  void add_number() {
    const std::size_t begin = at_;
    at_ = std::min(json_.find_first_not_of(kNumber, begin), json_.size());
    const std::string whole = whole_number(json_.substr(begin, at_ - begin));
    if (!whole.empty()) replace(begin, whole);
  }
  // The text that begins here, without its quotes.
  std::string_view skip_text() {
    const std::size_t begin = ++at_;
    while (at_ < json_.size() && json_[at_] != '"') at_ += json_[at_] == '\\' ? 2 : 1;
    const std::size_t end = std::min(at_, json_.size());
    at_ = std::min(end + 1, json_.size());
    return {json_.data() + begin, end - begin};
  }
  void skip_space() {
    while (at_ < json_.size() && std::string_view(" \t\r\n").contains(json_[at_])) ++at_;
  }
  // Returns false if the text before is no key.
  bool skip_to_value() {
    skip_space();
    if (at_ == json_.size() || json_[at_] != ':') return false;
    ++at_;
    skip_space();
    return true;
  }
  bool wanted(std::string_view key) {
    const auto has = [](const auto& all, std::string_view one) {
      return std::ranges::find(all, one) != all.end();
    };
    constexpr std::array<std::string_view, 8> kTop{"asset",      "nodes",     "skins",
                                                   "animations", "accessors", "bufferViews",
                                                   "buffers",    "extensions"};
    if (depth_ == 1) top_ = key;
    if (depth_ == 1) return has(kTop, key);
    if (top_ == "extensions" && depth_ == 2) return has(kExtensions, key);
    if (top_ == "extensions" && depth_ == 3) return key == "humanoid";
    if (key == "extras") return top_ == "animations" && depth_ == 3;  // timecodes
    return key != "extensions";
  }
  void blank_value() {
    const std::size_t begin = at_;
    std::size_t open = 0;
    while (at_ < json_.size()) {
      const char c = json_[at_];
      const bool closes = c == ']' || c == '}';
      if (open == 0 && (closes || c == ',')) break;
      open += c == '[' || c == '{' ? 1 : 0;
      open -= closes ? 1 : 0;
      if (c == '"') {
        skip_text();
      } else {
        ++at_;
      }
    }
    if (begin < at_) replace(begin, "0");
  }

  std::string_view json_;
  std::string out_;
  std::size_t copied_ = 0;  // of json_ into out_
  std::size_t at_ = 0, depth_ = 0, values_ = 0, buffers_ = 0;
  std::string_view top_;  // the key of the whole that is being read
};

// The file without what posed does not read.
Result<std::string> cut_out(const ClipFile& file) {
  const std::string& bytes = file.bytes;
  const std::string_view json = json_of(bytes);
  JsonCut cut(json);
  if (auto fits = cut.cut(); !fits) {
    return fail("is no glTF that can be read (" + fits.error().message + ")", file.name);
  }
  // tinygltf gives each buffer of a .glb a copy of its binary part.
  if (bytes.starts_with("glTF") && cut.buffers() > 1 &&
      cut.buffers() > kMaxCopied_bytes / std::max<std::size_t>(bytes.size() - json.size(), 1)) {
    return fail("is no glTF that can be read (it has several buffers, where a .glb has one)",
                file.name);
  }
  if (json.size() == bytes.size()) return cut.out();
  // A length that was wrong stays so.
  std::string whole = bytes.substr(0, kGlbHeader) + cut.out();
  while ((whole.size() - kGlbHeader - json.size()) % 4 != 0) whole += ' ';
  const auto longer = static_cast<std::uint32_t>(whole.size() - kGlbHeader - json.size());
  for (const std::size_t at : {kGlbLengthAt, kGlbJsonLengthAt}) {
    const std::uint32_t length = number_in(whole, at) + longer;
    std::memcpy(whole.data() + at, &length, sizeof length);
  }
  return whole.append(bytes, kGlbHeader + json.size());
}

Result<tinygltf::Model> load_model(const ClipFile& file) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(skip_image, nullptr);
  loader.SetFsCallbacks({.FileExists = always_exists,
                         .ExpandFilePath = same_path,
                         .ReadWholeFile = never_reads,
                         .WriteWholeFile = nullptr,
                         .user_data = nullptr});
  if (file.bytes.size() > std::numeric_limits<int>::max()) {
    return fail("is longer than the 2 GB that a glTF file can have", file.name);
  }
  const std::string read = TRY(cut_out(file));
  tinygltf::Model model;
  std::string error, warning;
  const auto size = static_cast<unsigned>(read.size());
  bool loaded = false;
  try {
    if (read.starts_with("glTF")) {
      const auto* bytes = reinterpret_cast<const unsigned char*>(read.data());
      loaded = loader.LoadBinaryFromMemory(&model, &error, &warning, bytes, size);
    } else {
      loaded = loader.LoadASCIIFromString(&model, &error, &warning, read.data(), size, "");
    }
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (loaded) return model;
  std::string why = clean(error.substr(0, std::min(error.find('\n'), kMaxWhy)));
  if (json_of(file.bytes).contains("EXT_meshopt_compression")) {
    why = "its numbers are packed by EXT_meshopt_compression; export it without compression";
  }
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

// Entries that lie evenly in a buffer view: `count` of `components` numbers. Null if they do not
// fit into it.
struct Entries {
  const unsigned char* at = nullptr;
  std::size_t stride = 0;
};
Entries entries_of(const tinygltf::Model& model, int view_index, std::size_t offset,
                   std::size_t count, std::size_t entry, bool packed) {
  if (view_index < 0 || view_index >= std::ssize(model.bufferViews) || count == 0) return {};
  const auto& view = model.bufferViews[static_cast<std::size_t>(view_index)];
  if (view.buffer < 0 || view.buffer >= std::ssize(model.buffers)) return {};
  const auto& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  const std::size_t stride = packed || view.byteStride == 0 ? entry : view.byteStride;
  const std::size_t begin = view.byteOffset + offset;
  if (begin < offset || begin > data.size() || data.size() - begin < entry) return {};
  if (stride == 0 || (data.size() - begin - entry) / stride < count - 1) return {};
  return {.at = data.data() + begin, .stride = stride};
}

std::size_t index_at(const unsigned char* at, int type) {
  std::uint32_t index = 0;  // glTF is little-endian
  const int bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type));
  std::memcpy(&index, at, static_cast<std::size_t>(bytes));
  return index;
}

// Puts the values of a sparse accessor where they belong. False if it is damaged.
bool add_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                std::size_t components, std::size_t part, std::vector<double>& numbers) {
  const auto& sparse = accessor.sparse;
  const int index_type = sparse.indices.componentType;
  const bool counts = index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                      index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                      index_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  if (!counts || sparse.count < 0 || sparse.indices.byteOffset < 0 ||
      sparse.values.byteOffset < 0) {
    return false;
  }
  const auto count = static_cast<std::size_t>(sparse.count);
  const auto index_bytes = static_cast<std::size_t>(
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(index_type)));
  const Entries indices =
      entries_of(model, sparse.indices.bufferView,
                 static_cast<std::size_t>(sparse.indices.byteOffset), count, index_bytes, true);
  const Entries values = entries_of(model, sparse.values.bufferView,
                                    static_cast<std::size_t>(sparse.values.byteOffset), count,
                                    components * part, true);
  if (indices.at == nullptr || values.at == nullptr) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t to = index_at(indices.at + i * indices.stride, index_type);
    if (to >= accessor.count) return false;
    for (std::size_t c = 0; c < components; ++c) {
      numbers[to * components + c] = number_at(values.at + i * values.stride + c * part,
                                               accessor.componentType, accessor.normalized);
    }
  }
  return true;
}

// As many numbers as the bytes of a file may stand for.
std::size_t most_numbers(const tinygltf::Model& model) {
  std::size_t bytes = 1'000'000;
  for (const tinygltf::Buffer& buffer : model.buffers) bytes += buffer.data.size();
  return std::min(bytes, kMaxNumbers);
}

// All numbers of an accessor with so many components an entry; empty if it is damaged or has a
// value that is none.
std::vector<double> numbers_of(const tinygltf::Model& model, int index, std::size_t components) {
  if (index < 0 || index >= std::ssize(model.accessors)) return {};
  const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(index)];
  const int size =
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  const bool fits = std::cmp_equal(
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)), components);
  if (!fits || size <= 0 || accessor.count > most_numbers(model) / components) return {};
  const auto part = static_cast<std::size_t>(size);
  std::vector<double> numbers;
  if (accessor.bufferView >= 0) {
    const Entries entries = entries_of(model, accessor.bufferView, accessor.byteOffset,
                                       accessor.count, components * part, false);
    if (entries.at == nullptr) return {};
    numbers.reserve(accessor.count * components);
    for (std::size_t i = 0; i < accessor.count; ++i) {
      for (std::size_t c = 0; c < components; ++c) {
        numbers.push_back(number_at(entries.at + i * entries.stride + c * part,
                                    accessor.componentType, accessor.normalized));
      }
    }
  } else if (accessor.sparse.isSparse) {
    numbers.resize(accessor.count * components);  // 0, but for those that are listed
  }
  if (accessor.sparse.isSparse && !add_sparse(model, accessor, components, part, numbers)) {
    return {};
  }
  if (!std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); })) return {};
  return numbers;
}

// The numbers of accessors, each read once however many channels and skins name it, and no more
// than the file has bytes for: accessors may overlap.
class Numbers {
 public:
  explicit Numbers(const tinygltf::Model& model) : model_(model), left_(2 * most_numbers(model)) {}
  // The same as numbers_of(), and empty once the numbers of all accessors are too many.
  std::span<const double> of(int index, std::size_t components) {
    const auto [place, is_new] = read_.try_emplace({index, components});
    if (!is_new) return place->second;
    if (index >= 0 && index < std::ssize(model_.accessors) &&
        model_.accessors[static_cast<std::size_t>(index)].count > left_ / components) {
      return {};
    }
    place->second = numbers_of(model_, index, components);
    left_ -= place->second.size();
    return place->second;
  }

 private:
  const tinygltf::Model& model_;
  std::map<std::pair<int, std::size_t>, std::vector<double>> read_;
  std::size_t left_;
};

// --- the tree of nodes

struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
};

Pose pose_of(const Eigen::Matrix4d& matrix) {
  Pose pose;
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  pose.position = matrix.topRightCorner<3, 1>();
  pose.scale = turn.colwise().norm();
  if ((pose.scale.array() > 0.0).all()) {
    pose.rotation =
        Eigen::Quaterniond(Eigen::Matrix3d(turn * pose.scale.cwiseInverse().asDiagonal()));
  }
  return pose;
}

Pose pose_of(const tinygltf::Node& node) {
  Pose pose;
  if (node.matrix.size() == 16) pose = pose_of(Eigen::Matrix4d(node.matrix.data()));
  if (node.translation.size() == 3) pose.position = Eigen::Vector3d(node.translation.data());
  if (node.rotation.size() == 4) pose.rotation = Eigen::Quaterniond(node.rotation.data());
  if (node.scale.size() == 3) pose.scale = Eigen::Vector3d(node.scale.data());
  pose.rotation =
      pose.rotation.norm() > 0.0 ? pose.rotation.normalized() : Eigen::Quaterniond::Identity();
  return pose;
}

struct Tree {
  std::vector<int> parent;  // [node]; -1: none
  int shared = -1;          // a node that hangs below two others, of which the first counts
  std::vector<int> order;   // the nodes, parents first; nodes of a circle are left out
};

Tree tree_of(const tinygltf::Model& model) {
  const std::size_t count = model.nodes.size();
  Tree tree{.parent = std::vector<int>(count, -1), .order = {}};
  for (std::size_t n = 0; n < count; ++n) {
    for (const int child : model.nodes[n].children) {
      if (child < 0 || child >= std::ssize(model.nodes)) continue;
      int& parent = tree.parent[static_cast<std::size_t>(child)];
      if (parent >= 0) tree.shared = child;
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

// Computes the nodes' world poses from their own. A scale changes positions and no rotation.
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

// --- the figure

// The bones that a VRM 0, a VRM 1 or a VRM animation names, by their nodes.
struct Humanoid {
  std::map<int, Bone> bones;
  bool backwards = false;  // VRM 0 looks along -Z
  bool animates = false;   // a VRM animation, whose rest is the T-pose whatever it looks like
};

// Returns a member of the object; a null value if it has none.
const tinygltf::Value& member(const tinygltf::Value& object, const std::string& name) {
  static const tinygltf::Value kNone;
  return object.IsObject() ? object.Get(name) : kNone;
}

Humanoid humanoid_of(const tinygltf::Model& model) {
  Humanoid found;
  const auto add = [&](std::string name, const tinygltf::Value& node, bool old_thumbs) {
    const int index = node.IsInt() ? node.GetNumberAsInt() : -1;
    if (index < 0 || index >= std::ssize(model.nodes)) return;
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
      found.bones.emplace(index, *bone);
    }
  };
  for (const std::string_view extension : kExtensions) {
    const auto at = model.extensions.find(std::string(extension));
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
      for (const std::string& name : bones.Keys()) {
        add(name, member(bones.Get(name), "node"), false);
      }
    }
    found.animates = extension == "VRMC_vrm_animation";
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

// The nodes that a humanoid names, or else the skins' joints.
std::set<int> joint_nodes(const tinygltf::Model& model, const Humanoid& humanoid) {
  std::set<int> nodes;
  for (const auto& [node, bone] : humanoid.bones) nodes.insert(node);
  if (!nodes.empty()) return nodes;
  for (const tinygltf::Skin& skin : model.skins)
    nodes.insert(skin.joints.begin(), skin.joints.end());
  std::erase_if(nodes, [&](int node) { return node < 0 || node >= std::ssize(model.nodes); });
  return nodes;
}

// Whether an animation turns or moves one of these nodes, or any where there are none.
bool moves_any(Numbers& numbers, const tinygltf::Animation& animation, const std::set<int>& nodes) {
  return std::ranges::any_of(animation.channels, [&](const tinygltf::AnimationChannel& channel) {
    const bool turns = channel.target_path == "rotation";
    if (!turns && channel.target_path != "translation") return false;
    if (!nodes.empty() && !nodes.contains(channel.target_node)) return false;
    if (channel.sampler < 0 || channel.sampler >= std::ssize(animation.samplers)) return false;
    const auto& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
    const std::size_t width = turns ? 4 : 3;
    const auto values = numbers.of(sampler.output, width);
    // A key of a cubic one is the tangent in, the value, the tangent out.
    const bool cubic = sampler.interpolation == "CUBICSPLINE";
    const std::size_t step = cubic ? 3 * width : width;
    for (std::size_t at = cubic ? width : 0; at + width <= values.size(); at += step) {
      for (std::size_t c = 0; c < width; ++c) {
        constexpr double kStill = 1e-6;
        if (std::abs(values[at + c] - values[(cubic ? width : 0) + c]) > kStill) return true;
      }
    }
    return false;
  });
}

// The first animation that moves the figure, because a file may begin with that of a camera, of
// faces or with a single pose. Null: none does.
const tinygltf::Animation* find_animation(const tinygltf::Model& model, const std::set<int>& nodes,
                                          Numbers& numbers) {
  for (std::size_t i = 0; i < std::min(model.animations.size(), kMaxAnimations); ++i) {
    if (moves_any(numbers, model.animations[i], nodes)) return &model.animations[i];
  }
  return nullptr;
}

// The nodes that count: a humanoid's; or the skins' joints, the nodes that the animation turns, and
// what hangs below them and shows nothing, because a joint may have no part in a skin; or all.
std::set<int> chosen_nodes(const tinygltf::Model& model, const Tree& tree, const Humanoid& humanoid,
                           const tinygltf::Animation* animation) {
  std::set<int> chosen = joint_nodes(model, humanoid);
  if (!humanoid.bones.empty()) return chosen;
  std::vector<char> shows(model.nodes.size(), 0);  // it or something below is a mesh or camera
  for (auto node = tree.order.rbegin(); node != tree.order.rend(); ++node) {
    const auto n = static_cast<std::size_t>(*node);
    if (model.nodes[n].mesh >= 0 || model.nodes[n].camera >= 0) shows[n] = 1;
    if (tree.parent[n] >= 0 && shows[n] != 0) shows[static_cast<std::size_t>(tree.parent[n])] = 1;
  }
  const bool skinned = !chosen.empty();
  for (std::size_t c = 0; animation != nullptr && c < animation->channels.size(); ++c) {
    const int node = animation->channels[c].target_node;
    if (node < 0 || node >= std::ssize(model.nodes)) continue;
    if (!skinned || model.nodes[static_cast<std::size_t>(node)].mesh < 0) chosen.insert(node);
  }
  std::set<int> more = chosen;
  for (const int node : tree.order) {
    const auto n = static_cast<std::size_t>(node);
    if (shows[n] == 0 && more.contains(tree.parent[n])) more.insert(node);
  }
  if (more.size() <= kMaxFigure) chosen = std::move(more);
  if (!chosen.empty()) return chosen;
  for (int node = 0; node < std::ssize(model.nodes); ++node) chosen.insert(node);
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

constexpr double kNearKey_s = 1e-4;

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
  // A step comes at its key, whose time is a rounded float.
  const auto next =
      std::ranges::upper_bound(time_s, between == Between::kStep ? time + kNearKey_s : time);
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

// How the animation moves the nodes that matter [node].
Result<std::vector<Track>> tracks_of(const tinygltf::Model& model,
                                     const tinygltf::Animation& animation,
                                     const std::vector<char>& matters, Numbers& numbers) {
  std::vector<Track> tracks;
  std::set<std::pair<int, bool>> seen;
  for (const tinygltf::AnimationChannel& channel : animation.channels) {
    const bool turns = channel.target_path == "rotation";
    if (!turns && channel.target_path != "translation") continue;
    if (channel.target_node < 0 || channel.target_node >= std::ssize(model.nodes)) continue;
    if (matters[static_cast<std::size_t>(channel.target_node)] == 0) continue;
    if (!seen.emplace(channel.target_node, turns).second) continue;  // glTF allows one
    if (channel.sampler < 0 || channel.sampler >= std::ssize(animation.samplers)) {
      return fail("a channel of its animation has no sampler; it is damaged");
    }
    const auto& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
    Track track{.node = channel.target_node,
                .path = turns ? Track::Path::kRotation : Track::Path::kPosition};
    if (sampler.interpolation == "STEP") track.between = Track::Between::kStep;
    if (sampler.interpolation == "CUBICSPLINE") track.between = Track::Between::kCubic;
    const auto width = static_cast<std::size_t>(track.width());
    track.time_s = numbers.of(sampler.input, 1);
    track.values = numbers.of(sampler.output, width);
    const std::size_t parts = track.between == Track::Between::kCubic ? 3 : 1;
    if (track.time_s.empty() || track.values.size() != track.time_s.size() * parts * width ||
        !std::ranges::is_sorted(track.time_s)) {
      return fail("the keys of node " + std::to_string(channel.target_node) + " are damaged");
    }
    tracks.push_back(track);
  }
  return tracks;
}

// The times of the frames. They are evenly spaced, and on the keys of the track that has most if
// those are even. In a file that posed wrote, uneven keys are the frames of a live recording and
// are the times themselves.
struct Times {
  double rate_hz = kStillRate_hz;
  double first_s = 0.0;
  std::size_t frames = 1;
  std::span<const double> keys_s{};  // empty: evenly spaced

  [[nodiscard]] double at(std::size_t frame) const {
    return keys_s.empty() ? first_s + static_cast<double>(frame) / rate_hz : keys_s[frame];
  }
};

// The rate of uneven keys, as of a live recording, by their median step; 0: too high to be a rate.
double usual_rate_hz(std::span<const double> keys_s) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < keys_s.size(); ++i) steps_s.push_back(keys_s[i] - keys_s[i - 1]);
  if (steps_s.empty()) return 0.0;
  const double rate_hz = 1.0 / std::max(median(steps_s), 1e-9);
  return rate_hz <= kMaxKeyRate_hz ? rate_hz : 0.0;
}

// `own` is true of a file that posed wrote: its tracks share their keys, one a frame.
Times times_of(const std::vector<Track>& tracks, bool own) {
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
  constexpr double kNear = 0.05;          // of a frame
  constexpr double kMinKeyRate_hz = 5.0;  // where keys are farther apart, a motion is between them
  bool even = keys.size() > 1 && (own || rate_hz >= kMinKeyRate_hz) && rate_hz <= kMaxKeyRate_hz;
  for (std::size_t i = 0; even && i < keys.size(); ++i) {
    even = std::abs((keys[i] - keys.front()) * rate_hz - static_cast<double>(i)) < kNear;
  }
  const double whole_hz = std::round(rate_hz);
  times.rate_hz = !even ? std::max(kUnevenRate_hz, std::round(usual_rate_hz(keys)))
                  : std::abs(rate_hz - whole_hz) < 1e-4 * whole_hz ? whole_hz
                                                                   : rate_hz;
  if (own && !even && std::ranges::adjacent_find(keys, std::greater_equal()) == keys.end()) {
    const double usual_hz = usual_rate_hz(keys);
    return {.rate_hz = usual_hz > 0.0 ? usual_hz : times.rate_hz,
            .first_s = keys.front(),
            .frames = keys.size(),
            .keys_s = keys};
  }
  const double frames = (last_s - times.first_s) * times.rate_hz + kNear;
  times.frames = frames < std::max(kMaxFramesAKey * (steps + 1.0), kFewFrames)
                     ? static_cast<std::size_t>(frames) + 1
                     : std::numeric_limits<std::size_t>::max();
  return times;
}

// The timecodes that gltf.cpp writes: each frame has that of its newest key. Empty for other files.
std::vector<Timecode> timecodes_of(const tinygltf::Animation* animation,
                                   const std::vector<Track>& tracks, const Times& times) {
  if (animation == nullptr || tracks.empty()) return {};
  const tinygltf::Value& extras = animation->extras;
  if (!extras.IsObject() || !extras.Has("timecodes")) return {};
  const tinygltf::Value& keys = extras.Get("timecodes");
  const std::span<const double> key_s = tracks.front().time_s;
  if (!keys.IsArray() || keys.ArrayLen() != key_s.size()) return {};
  std::vector<Timecode> out;
  for (std::size_t i = 0; i < times.frames; ++i) {
    const double near_s = times.keys_s.empty() ? kNearKey_s : 0.0;
    const auto next = std::ranges::upper_bound(key_s, times.at(i) + near_s) - key_s.begin();
    const tinygltf::Value& code = keys.Get(static_cast<int>(std::max(next - 1, std::ptrdiff_t{0})));
    out.push_back(code.IsString() ? to_timecode(code.Get<std::string>()) : Timecode{});
  }
  return out;
}

// --- the clip

class Reader {
 public:
  Reader(const tinygltf::Model& model, const ClipFile& file)
      : model_(model), file_(file), numbers_(model), tree_(tree_of(model)) {
    for (const tinygltf::Node& node : model.nodes) rest_.push_back(pose_of(node));
  }

  Result<Draft> read();

 private:
  struct Bound {
    std::map<int, Pose> pose;  // [node], in the space of a mesh
    double scale = 1.0;        // from there to the world
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  };
  [[nodiscard]] std::map<int, Pose> bound_poses();
  [[nodiscard]] std::optional<Bound> other_rest(Draft& draft);
  void rest_in(const Bound& bound);
  [[nodiscard]] std::vector<char> nodes_that_matter() const;
  void remark(Draft& draft) const;
  [[nodiscard]] bool moves(std::size_t joint, const std::vector<Track>& tracks) const;
  void describe(const std::vector<Track>& tracks, Draft& draft) const;
  [[nodiscard]] std::vector<char> rests_in_t() const;
  void add_frame(const std::vector<Pose>& world, std::vector<std::array<double, 3>>& near,
                 Draft& draft) const;

  const tinygltf::Model& model_;
  const ClipFile& file_;
  Numbers numbers_;
  Tree tree_;
  std::vector<Pose> rest_;  // [node], in its parent
  Humanoid humanoid_;
  Figure figure_;
  const tinygltf::Animation* animation_ = nullptr;
  bool moves_ = false;            // the animation moves the figure
  std::vector<Pose> world_rest_;  // [node]; of the figure's nodes as it rests
  Eigen::Quaterniond forwards_ = Eigen::Quaterniond::Identity();
};

// Where the skins' joints stood when the skins were bound to them, all in the space of one mesh.
std::map<int, Pose> Reader::bound_poses() {
  std::map<int, Pose> all;
  for (const tinygltf::Skin& skin : model_.skins) {
    const auto numbers = numbers_.of(skin.inverseBindMatrices, 16);
    if (numbers.size() != 16 * skin.joints.size()) continue;
    std::map<int, Pose> own;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      const Eigen::Matrix4d inverse =
          Eigen::Map<const Eigen::Matrix4d>(numbers.data() + 16 * j).inverse();
      if (inverse.allFinite()) own.emplace(skin.joints[j], pose_of(inverse));
    }
    // Each skin may have a space of its own; a joint of both brings them together.
    const auto common =
        std::ranges::find_if(own, [&](const auto& entry) { return all.contains(entry.first); });
    if (!all.empty() && common == own.end()) continue;
    const Pose from = common == own.end() ? Pose{} : common->second;
    const Pose to = common == own.end() ? Pose{} : all.at(common->first);
    const Eigen::Quaterniond turn = to.rotation * from.rotation.conjugate();
    const double scale = to.scale.mean() / from.scale.mean();
    for (auto& [node, pose] : own) {
      pose.position = to.position + turn * (scale * (pose.position - from.position));
      pose.rotation = turn * pose.rotation;
      pose.scale *= scale;
      all.emplace(node, pose);
    }
  }
  return all;
}

// The quarter turns that come nearest to a rotation.
Eigen::Quaterniond quarter_turns(const Eigen::Quaterniond& rotation) {
  Eigen::Matrix3d left = rotation.toRotationMatrix(), turns = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 2; ++i) {
    int row = 0, column = 0;
    left.cwiseAbs().maxCoeff(&row, &column);
    turns(row, column) = left(row, column) < 0.0 ? -1.0 : 1.0;
    left.row(row).setZero();
    left.col(column).setZero();
  }
  int row = 0, column = 0;
  left.cwiseAbs().maxCoeff(&row, &column);
  turns(row, column) = 1.0;
  if (turns.determinant() < 0.0) turns(row, column) = -1.0;
  return Eigen::Quaterniond(turns);
}

// How the pose in which the skins were bound becomes the figure's rest, where the nodes have
// another one. Nothing says how the mesh stood in the world then: its axes stay, and it is laid as
// near to the nodes as quarter turns bring it, so that the pose stays straight. Empty: the nodes
// rest as the skins were bound, or nothing tells.
std::optional<Reader::Bound> Reader::other_rest(Draft& draft) {
  if (!humanoid_.bones.empty()) return std::nullopt;  // VRM says that the nodes stand in T
  Bound bound{.pose = bound_poses()};
  std::vector<double> ratios;
  std::optional<Eigen::Quaterniond> first;
  bool same = true;
  for (std::size_t j = 0; j < figure_.nodes.size(); ++j) {
    const auto at = bound.pose.find(figure_.nodes[j]);
    if (at == bound.pose.end()) continue;
    const Pose& now = world_rest_[static_cast<std::size_t>(at->first)];
    const Eigen::Quaterniond turn = now.rotation * at->second.rotation.conjugate();
    constexpr double kSame_rad = 0.01;
    if (!first) first = turn;
    same = same && first->angularDistance(turn) < kSame_rad;
    if (figure_.parents[j] < 0) continue;
    const int parent = figure_.nodes[static_cast<std::size_t>(figure_.parents[j])];
    const auto above = bound.pose.find(parent);
    if (above == bound.pose.end()) continue;
    const double length = (at->second.position - above->second.position).norm();
    const double now_m = (now.position - world_rest_[std::size_t(parent)].position).norm();
    if (length > 0.0) ratios.push_back(now_m / length);
  }
  if (same || ratios.empty()) return std::nullopt;
  bound.scale = median(ratios);
  bound.turn = quarter_turns(*first);
  const auto alike = std::ranges::count_if(
      ratios, [&](double ratio) { return std::abs(ratio - bound.scale) < 0.02 * bound.scale; });
  if (bound.scale > 0.0 && 5 * alike >= 4 * std::ssize(ratios)) return bound;
  draft.warnings.emplace_back(
      "its skin was bound to bones of other lengths; the figure rests as its nodes stand");
  return std::nullopt;
}

void Reader::rest_in(const Bound& bound) {
  std::vector<std::optional<Pose>> laid(world_rest_.size());  // [node]
  for (const int node : figure_.nodes) {
    const auto at = bound.pose.find(node);
    if (at == bound.pose.end()) continue;
    auto& pose = laid[static_cast<std::size_t>(node)].emplace();
    pose.position = bound.turn * (bound.scale * at->second.position);
    pose.rotation = bound.turn * at->second.rotation;
  }
  // A joint that no skin has keeps its place and turn beside a child, or else its parent.
  const auto place = [&](int from_node, int to_node) {
    const auto from = static_cast<std::size_t>(from_node), to = static_cast<std::size_t>(to_node);
    if (!laid[from] || laid[to]) return;
    const Eigen::Quaterniond change = laid[from]->rotation * world_rest_[from].rotation.conjugate();
    auto& pose = laid[to].emplace();
    pose.position =
        laid[from]->position + change * (world_rest_[to].position - world_rest_[from].position);
    pose.rotation = change * world_rest_[to].rotation;
  };
  const auto parent_of = [this](std::size_t joint) {
    return figure_.nodes[static_cast<std::size_t>(figure_.parents[joint])];
  };
  for (std::size_t j = figure_.nodes.size(); j-- > 1;) place(figure_.nodes[j], parent_of(j));
  for (std::size_t j = 1; j < figure_.nodes.size(); ++j) place(parent_of(j), figure_.nodes[j]);
  for (const auto& [joint, tip] : figure_.tips) {
    place(figure_.nodes[static_cast<std::size_t>(joint)], tip);
  }
  const auto root = static_cast<std::size_t>(figure_.nodes[0]);
  const Eigen::Vector3d moved = world_rest_[root].position - laid[root]->position;
  for (std::size_t n = 0; n < laid.size(); ++n) {
    if (!laid[n]) continue;
    world_rest_[n].position = laid[n]->position + moved;
    world_rest_[n].rotation = laid[n]->rotation;
  }
}

// Whether a joint needs position channels: it changes its distance from its parent, as hips below a
// root do, or is elsewhere than at rest, as the hips of one who sits all the time are.
bool Reader::moves(std::size_t joint, const std::vector<Track>& tracks) const {
  constexpr double kStill_m = 0.001;
  if (joint == 0) return true;
  const auto node = static_cast<std::size_t>(figure_.nodes[joint]);
  const Pose& above = world_rest_[static_cast<std::size_t>(
      figure_.nodes[static_cast<std::size_t>(figure_.parents[joint])])];
  const Eigen::Vector3d rest =
      above.rotation.conjugate() * (world_rest_[node].position - above.position);
  const auto elsewhere = [&](const Eigen::Vector3d& own) {
    return (above.scale.cwiseProduct(own) - rest).norm() > kStill_m;
  };
  const auto track = std::ranges::find_if(tracks, [&](const Track& at) {
    return at.node == figure_.nodes[joint] && at.path == Track::Path::kPosition;
  });
  if (track == tracks.end()) return elsewhere(rest_[node].position);
  for (std::size_t i = 0; i < track->time_s.size(); ++i) {
    if (elsewhere(track->key(i, 1).head<3>())) return true;
  }
  return false;
}

void Reader::describe(const std::vector<Track>& tracks, Draft& draft) const {
  Skeleton& skeleton = draft.skeleton;
  skeleton.name = std::filesystem::path(file_.name).stem().string();
  JointNames names;
  for (std::size_t j = 0; j < figure_.nodes.size(); ++j) {
    const auto n = static_cast<std::size_t>(figure_.nodes[j]);
    Joint& joint = skeleton.joints.emplace_back();
    joint.parent = figure_.parents[j];
    std::string name = clean(model_.nodes[n].name);
    if (name.empty()) name = "node" + std::to_string(n);
    joint.name = names.add(std::move(name),
                           joint.parent < 0 ? std::string() : skeleton.joints[joint.parent].name);
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
  if (std::string said = names.warning(); !said.empty()) draft.warnings.push_back(std::move(said));
}

// Whether each joint of a humanoid stands in the T-pose at rest. VRM asks it of avatars, but some
// are exported with hanging arms or with legs apart: T of such a limb is found from its bones. Its
// foot stays as it rests, for the sole is flat then.
std::vector<char> Reader::rests_in_t() const {
  struct Limb {
    Bone upper, lower, end;
    Eigen::Vector3d way;  // of the T-pose
  };
  using enum Bone;
  const std::array<Limb, 4> limbs{
      {{kLeftUpperArm, kLeftLowerArm, kLeftHand, Eigen::Vector3d::UnitX()},
       {kRightUpperArm, kRightLowerArm, kRightHand, -Eigen::Vector3d::UnitX()},
       {kLeftUpperLeg, kLeftLowerLeg, kLeftFoot, -Eigen::Vector3d::UnitY()},
       {kRightUpperLeg, kRightLowerLeg, kRightFoot, -Eigen::Vector3d::UnitY()}}};
  std::map<Bone, Eigen::Vector3d> place;
  for (std::size_t j = 0; j < figure_.bones.size(); ++j) {
    const auto node = static_cast<std::size_t>(figure_.nodes[j]);
    if (figure_.bones[j]) place[*figure_.bones[j]] = forwards_ * world_rest_[node].position;
  }
  // More than the slopes of arms and legs that their makers take for straight.
  constexpr double kOff_rad = 5.0 * std::numbers::pi / 180.0;
  const auto off = [&](Bone from, Bone to, const Eigen::Vector3d& way) {
    if (!place.contains(from) || !place.contains(to)) return false;
    const Eigen::Vector3d bone = place[to] - place[from];
    return bone.dot(way) < std::cos(kOff_rad) * bone.norm();
  };
  std::set<Bone> bent;  // upper bones of limbs
  for (const Limb& limb : limbs) {
    if (off(limb.upper, limb.lower, limb.way) || off(limb.lower, limb.end, limb.way)) {
      bent.insert(limb.upper);
    }
  }
  const auto stands = [&](std::optional<Bone> bone) {
    for (; bone && *bone != kLeftFoot && *bone != kRightFoot; bone = parent_of(*bone)) {
      if (bent.contains(*bone)) return false;
    }
    return true;
  };
  std::vector<char> joints;
  joints.reserve(figure_.bones.size());
  for (const auto& bone : figure_.bones) {
    joints.push_back(bone && (humanoid_.animates || stands(bone)) ? 1 : 0);
  }
  return joints;
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

// The nodes of the figure and those above them [node].
std::vector<char> Reader::nodes_that_matter() const {
  std::vector<char> matters(model_.nodes.size(), 0);
  for (int node : figure_.nodes) {
    for (; node >= 0 && matters[static_cast<std::size_t>(node)] == 0;
         node = tree_.parent[static_cast<std::size_t>(node)]) {
      matters[static_cast<std::size_t>(node)] = 1;
    }
  }
  return matters;
}

void Reader::remark(Draft& draft) const {
  if (animation_ == nullptr) {
    draft.warnings.emplace_back("has no animation; its rest pose is the only frame");
  } else if (model_.animations.size() > 1) {
    const auto number = animation_ - model_.animations.data() + 1;
    const std::string name = animation_->name.empty() ? "" : ", " + in_quotes(animation_->name);
    draft.warnings.push_back(
        "has " + std::to_string(model_.animations.size()) + " animations; number " +
        std::to_string(number) + name + " is read, " +
        (moves_ ? "the first that moves the figure" : "since none moves the figure"));
  }
  if (animation_ != nullptr && animation_->extras.IsObject()) {
    const tinygltf::Value& remark = member(animation_->extras, kGltfRemark);
    if (remark.IsString()) draft.warnings.push_back(clean(remark.Get<std::string>()));
  }
  if (tree_.shared >= 0) {
    draft.warnings.push_back("node " + std::to_string(tree_.shared) +
                             " hangs below two others, of which the first counts; it is damaged");
  }
}

Result<Draft> Reader::read() {
  if (model_.nodes.empty()) return fail("has no nodes, so there is no figure in it");
  if (model_.nodes.size() > kMaxNodes) return fail("has too many nodes to be a figure");
  humanoid_ = humanoid_of(model_);
  if (humanoid_.backwards)
    forwards_ = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY());
  animation_ = find_animation(model_, joint_nodes(model_, humanoid_), numbers_);
  moves_ = animation_ != nullptr;
  if (!moves_ && !model_.animations.empty()) animation_ = &model_.animations.front();
  figure_ = figure_of(model_, tree_, chosen_nodes(model_, tree_, humanoid_, animation_), humanoid_);
  if (figure_.nodes.empty()) return fail("its nodes go in a circle; it is damaged");
  if (figure_.nodes.size() > kMaxFigure) {
    return fail("has a figure of more than " + std::to_string(kMaxFigure) + " joints");
  }
  world_rest_.resize(rest_.size());
  place(tree_, rest_, world_rest_);
  Draft draft;
  const auto bound = other_rest(draft);
  if (bound) rest_in(*bound);
  // A rest pose that rest_in() has laid does not show that the file's up axis is wrong.
  draft.up_may_err = !bound && figure_.bones.empty();
  const std::vector<char> matters = nodes_that_matter();
  std::erase_if(tree_.order,
                [&](int node) { return matters[static_cast<std::size_t>(node)] == 0; });
  std::vector<Track> tracks;
  if (animation_ != nullptr) tracks = TRY(tracks_of(model_, *animation_, matters, numbers_));
  const Times times = times_of(tracks, model_.asset.generator == kGltfGenerator);
  describe(tracks, draft);
  draft.bones = figure_.bones;
  draft.rests_in_t = rests_in_t();
  draft.frame_rate_hz = times.rate_hz;
  if (times.frames > kMaxNumbers / draft.skeleton.channels.size() ||
      times.frames > kMaxSteps / (tree_.order.size() + tracks.size())) {
    return fail("its animation is longer than a clip can be; cut it");
  }
  remark(draft);
  if (!times.keys_s.empty()) {
    draft.warnings.emplace_back(
        "frames are not evenly spaced; what goes by frames takes them as if they were");
  }
  draft.timecode = timecodes_of(animation_, tracks, times);
  std::vector<std::array<double, 3>> near(figure_.nodes.size());
  std::vector<Pose> own = rest_, world = world_rest_;
  for (std::size_t i = 0; i < times.frames; ++i) {
    const double time_s = times.at(i);
    if (!times.keys_s.empty()) draft.time_s.push_back(time_s - times.first_s);
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
  draft->said_up = options.up;
  draft->said_facing = options.facing;
  draft->said_unit_m = options.metres_per_unit;
  draft->unit_may_err = draft->bones.empty();
  draft->metres_per_unit = 0.01;  // of a BVH that is written of it: programs take that for cm
  if (draft->bones.empty()) draft->profile = TRY(find_profile(draft->skeleton, options.profile));
  return draft;
}

// .vrm is an avatar: a figure without motion.
Format gltf_format() {
  return {
      .name = "glTF",
      .extensions = {".gltf", ".vrm"},
      .options = {ReadOption::kUnit, ReadOption::kUp, ReadOption::kFacing, ReadOption::kProfile},
      .sniff =
          [](std::string_view begin) {
            return begin.starts_with('{') &&
                   (begin.contains("\"asset\"") || begin.contains("\"accessors\""));
          },
      .read = read_gltf};
}

}  // namespace posed::clip
