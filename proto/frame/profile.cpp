#include "proto/frame/profile.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "proto/frame/axes_text.hpp"
#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed {
namespace {

constexpr std::uintmax_t kMaxProfileBytes = 1 << 20;

void read_bones(TableReader& table, Profile& profile) {
  for (const std::string& key : table.keys()) {  // canonical bone = "joint"
    std::string joint;
    table.read(key, joint);
    const auto bone = bone_from_name(key);
    if (!bone) {
      table.add_error(key, in_quotes(key) + " is no canonical bone");
    } else if (!profile.bones.emplace(joint, *bone).second) {
      table.add_error(key, "joint " + in_quotes(joint) + " is given to two bones");
    }
  }
}

// T of a joint as three angles [deg] or as text.
std::optional<Eigen::Quaterniond> read_t(TableReader& table, const std::string& joint) {
  if (!table.has_text(joint)) {
    const auto angle_deg = table.numbers<3>(joint, {-360.0, 360.0});  // as Acclaim's axis
    if (!angle_deg) return std::nullopt;
    const auto [x, y, z] = *angle_deg;  // x is innermost
    return axis_rotation(Axis::kZ, z * kDegree) *
           (axis_rotation(Axis::kY, y * kDegree) * axis_rotation(Axis::kX, x * kDegree));
  }
  std::string axes;
  table.read(joint, axes);
  auto T = axes_from_text(axes);
  if (!T) table.add_error(joint, "T says where x, y and z point, for example \"+y-x+z\"");
  return T;
}

bool points_along(const Joint& joint, std::string_view axis) {
  if (axis.size() != 2 || axis[1] < 'x' || axis[1] > 'z') return false;
  const double sign = axis[0] == '-' ? -1.0 : 1.0;
  return sign * joint.offset_m[axis[1] - 'x'] > 0.9 * joint.offset_m.norm();
}

// Of a body fingers may be missing, because not everybody wears gloves.
bool may_lack(const Profile& profile, Bone bone) {
  const auto is_hips = [](const auto& entry) { return entry.second == Bone::kHips; };
  return bone >= Bone::kLeftThumbMetacarpal && std::ranges::any_of(profile.bones, is_hips);
}

bool matches(const Profile& profile, const Skeleton& skeleton) {
  const auto has = [&skeleton](const std::string& joint) {
    return skeleton.joint_index(joint) >= 0;
  };
  if (profile.match.empty() || !std::ranges::all_of(profile.match, has)) return false;
  const auto has_joint = [&](const auto& entry) {
    return has(entry.first) || may_lack(profile, entry.second);
  };
  if (!std::ranges::all_of(profile.bones, has_joint)) return false;
  return std::ranges::all_of(profile.along, [&skeleton](const auto& entry) {
    const int joint = skeleton.joint_index(entry.first);
    return joint >= 0 && points_along(skeleton.joints[joint], entry.second);
  });
}

}  // namespace

Result<Profile> parse_profile(std::string_view text, const std::string& name) {
  const auto table = TRY(parse_toml(text, name, {.what = "skeleton profile"}));
  Findings findings{.file = name};
  TableReader reader(table, "", findings);
  Profile profile;
  std::string note;
  reader.require("name", profile.name);
  reader.read("note", note);
  if (reader.has("metres_per_unit")) {
    reader.read("metres_per_unit", profile.metres_per_unit.emplace(), {1e-6, 1e6});
  }
  std::string up(up_text(profile.up));
  reader.read("up", up);
  if (const auto axis = up_from_text(up)) {
    profile.up = *axis;
  } else {
    reader.add_error("up", "up is +y, +z, -y, -z or +x");
  }
  reader.read("person", profile.person);
  reader.read("match", profile.match);
  if (auto along = reader.table("along")) {
    for (const std::string& joint : along->keys()) along->read(joint, profile.along[joint]);
  }
  reader.need("bones", "a profile names the joints of canonical bones");
  if (auto bones = reader.table("bones")) read_bones(*bones, profile);
  if (auto angles = reader.table("T")) {
    for (const std::string& joint : angles->keys()) {
      if (const auto T = read_t(*angles, joint)) profile.T.emplace(joint, *T);
    }
  }
  reader.finish();
  return findings.result(std::move(profile));
}

Result<std::string> load_profile_text(const std::string& file) {
  return load_file(file, {.what = "skeleton profile", .max_bytes = kMaxProfileBytes});
}

std::span<const Profile> profiles() {
  static const std::vector<Profile> all = [] {
    std::vector<Profile> read;
    for (const ConfigText& text : profile_texts()) {
      auto profile = parse_profile(text.content, std::string(text.file));
      if (!profile) {  // a bug in posed: the text is built into the program
        std::fprintf(stderr, "posed: %s\n", profile.error().text().c_str());
        std::abort();
      }
      read.push_back(std::move(*profile));
    }
    return read;
  }();
  return all;
}

Result<std::shared_ptr<const Profile>> find_profile(const Skeleton& skeleton,
                                                    const std::string& name) {
  if (name.ends_with(kProfileEnding)) {
    const std::string text = TRY(load_profile_text(name));
    auto profile = TRY(parse_profile(text, name));
    return std::make_shared<const Profile>(std::move(profile));
  }
  std::string known;
  for (const Profile& profile : profiles()) {
    const bool is_it = name.empty() ? matches(profile, skeleton) : profile.name == name;
    // Built-in profiles are never freed.
    if (is_it) return std::shared_ptr<const Profile>(std::shared_ptr<void>(), &profile);
    add_word(known, profile.name);
  }
  if (name.empty()) return nullptr;
  return misuse("there is no skeleton profile " + in_quotes(name) + "; there are " + known);
}

Result<std::vector<std::optional<Bone>>> named_bones(const Profile& profile,
                                                     const Skeleton& skeleton) {
  std::vector<std::optional<Bone>> bones(skeleton.joints.size());
  constexpr int kListed = 5;
  std::string missing;
  int count = 0;
  for (const auto& [joint, bone] : profile.bones) {
    const int index = skeleton.joint_index(joint);
    if (index >= 0) bones[index] = bone;
    if (index >= 0 || may_lack(profile, bone)) continue;
    if (++count <= kListed) add_word(missing, joint);
  }
  if (count > kListed) missing += " and " + std::to_string(count - kListed) + " more";
  if (count > 0) {
    return fail("the skeleton is not of profile " + in_quotes(profile.name) + ": it has no joint " +
                missing);
  }
  return bones;
}

std::vector<std::optional<Eigen::Quaterniond>> known_t(const Profile& profile,
                                                       const Skeleton& skeleton) {
  std::vector<std::optional<Eigen::Quaterniond>> known(skeleton.joints.size());
  for (const auto& [joint, T] : profile.T) {
    if (const int index = skeleton.joint_index(joint); index >= 0) known[index] = T;
  }
  return known;
}

}  // namespace posed
