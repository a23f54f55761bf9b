#include "proto/frame/profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "proto/frame/degree.hpp"
#include "proto/frame/profile_texts.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/toml.hpp"

namespace posed {
namespace {

class ProfileReader : private FirstError {
 public:
  using FirstError::FirstError;

  Result<Profile> read(const toml::table& table) {
    for (const auto& [key, node] : table) entry(key.str(), node);
    if (profile_.name.empty()) add_error(table, "a profile needs a name");
    if (profile_.bones.empty()) add_error(table, "a profile needs its [bones]");
    if (error()) return std::unexpected(*error());
    return std::move(profile_);
  }

 private:
  void entry(std::string_view key, const toml::node& node) {
    if (key == "name") {
      profile_.name = node.value_or("");
    } else if (key == "note") {
      if (!node.is_string()) add_error(node, "note is a text");
    } else if (key == "metres_per_unit") {
      profile_.metres_per_unit = node.value<double>();
      if (!profile_.metres_per_unit || !(*profile_.metres_per_unit > 0)) {
        add_error(node, "metres_per_unit is a length in metres");
      }
    } else if (key == "person" && node.is_boolean()) {
      profile_.person = node.value_or(true);
    } else if (key == "match" && node.is_array()) {
      for (const toml::node& joint : *node.as_array()) {
        profile_.match.push_back(joint.value_or(""));
      }
    } else if ((key == "along" || key == "bones" || key == "T") && node.is_table()) {
      for (const auto& [joint, value] : *node.as_table()) pair(key, joint.str(), value);
    } else {
      add_error(node, in_quotes(key) + " is not known in a profile, or of another type");
    }
  }

  void pair(std::string_view table, std::string_view key, const toml::node& value) {
    const std::string text = value.value_or("");
    if (table == "along") {
      profile_.along.emplace(key, text);
    } else if (table == "bones") {  // canonical bone = "joint"
      const auto bone = bone_from_name(key);
      if (!bone) return add_error(value, in_quotes(key) + " is no canonical bone");
      if (!profile_.bones.emplace(text, *bone).second) {
        add_error(value, "joint " + in_quotes(text) + " is given to two bones");
      }
    } else if (value.is_array()) {
      const auto T = from_angles(*value.as_array());
      if (!T)
        return add_error(value, "T as angles is three numbers [deg]: x, y, z, as Acclaim's axis");
      profile_.T.emplace(key, *T);
    } else {
      const auto T = axes_from_text(text);
      if (!T) return add_error(value, "T says where x, y and z point, for example \"+y-x+z\"");
      profile_.T.emplace(key, *T);
    }
  }

  static std::optional<Eigen::Quaterniond> from_angles(const toml::array& angles) {
    Eigen::Quaterniond T = Eigen::Quaterniond::Identity();
    if (angles.size() != 3) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto angle_deg = angles[i].value<double>();
      if (!angle_deg || !std::isfinite(*angle_deg)) return std::nullopt;
      T = axis_rotation(static_cast<Axis>(i), *angle_deg * kDegree) * T;  // x is innermost
    }
    return T;
  }

  Profile profile_;
};

bool points_along(const Joint& joint, std::string_view axis) {
  if (axis.size() != 2 || axis[1] < 'x' || axis[1] > 'z') return false;
  const double sign = axis[0] == '-' ? -1.0 : 1.0;
  return sign * joint.offset_m[axis[1] - 'x'] > 0.9 * joint.offset_m.norm();
}

bool matches(const Profile& profile, const Skeleton& skeleton) {
  const auto has = [&skeleton](const std::string& joint) {
    return skeleton.joint_index(joint) >= 0;
  };
  if (profile.match.empty() || !std::ranges::all_of(profile.match, has)) return false;
  return std::ranges::all_of(profile.along, [&skeleton](const auto& entry) {
    const int joint = skeleton.joint_index(entry.first);
    return joint >= 0 && points_along(skeleton.joints[joint], entry.second);
  });
}

}  // namespace

Result<Profile> parse_profile(std::string_view text, const std::string& name) {
  const auto table = parse_toml(text, name, {.what = "skeleton profile"});
  if (!table) return std::unexpected(table.error());
  return ProfileReader(name).read(*table);
}

std::span<const Profile> profiles() {
  static const std::vector<Profile> all = [] {
    std::vector<Profile> read;
    for (const ProfileText& text : profile_texts()) {
      auto profile = parse_profile(text.toml, std::string(text.file));
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

Result<const Profile*> find_profile(const Skeleton& skeleton, const std::string& name) {
  std::string known;
  for (const Profile& profile : profiles()) {
    if (name.empty() ? matches(profile, skeleton) : profile.name == name) return &profile;
    known += (known.empty() ? "" : ", ") + profile.name;
  }
  if (name.empty()) return nullptr;
  return misuse("there is no skeleton profile " + in_quotes(name) + "; there are " + known);
}

Result<> name_bones(const Profile& profile, Skeleton& skeleton) {
  std::string missing;
  for (const auto& [joint, bone] : profile.bones) {
    const int index = skeleton.joint_index(joint);
    if (index < 0) {
      missing += (missing.empty() ? "" : ", ") + joint;
    } else {
      skeleton.joints[index].bone = bone;
    }
  }
  if (!missing.empty()) {
    return fail("the skeleton is not of profile " + in_quotes(profile.name) + ": it has no joint " +
                missing);
  }
  return {};
}

KnownT known_t(const Profile& profile, const Skeleton& skeleton) {
  KnownT known(skeleton.joints.size());
  for (const auto& [joint, T] : profile.T) {
    if (const int index = skeleton.joint_index(joint); index >= 0) known[index] = T;
  }
  return known;
}

}  // namespace posed
