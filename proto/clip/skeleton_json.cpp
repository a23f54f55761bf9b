#include "proto/clip/skeleton_json.hpp"

#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "proto/frame/plausible.hpp"
#include "proto/text/json_text.hpp"

namespace posed::clip {
namespace {

using nlohmann::json;

json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json numbers(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

Eigen::Vector3d vector_of(const json& value) {
  const auto v = value.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

// Not of length 1 where the text is damaged; finish() does not look at it, so check_rotation()
// does.
Eigen::Quaterniond rotation_of(const json& value) {
  const auto q = value.get<std::array<double, 4>>();
  return {q[3], q[0], q[1], q[2]};
}

bool is_rotation(const Eigen::Quaterniond& q) { return std::abs(q.squaredNorm() - 1.0) < 1e-6; }
bool is_length(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMaxPosition_m;
}

json joint_json(const Joint& joint) {
  json out{{"name", joint.name},
           {"parent", joint.parent},
           {"offset_m", numbers(joint.offset_m)},
           {"T_xyzw", numbers(joint.T_world_joint)}};
  if (joint.bone) out["bone"] = bone_name(*joint.bone);
  if (joint.end_site_m) out["end_site_m"] = numbers(*joint.end_site_m);
  if (!joint.channel_frame.isApprox(Eigen::Quaterniond::Identity())) {
    out["channel_frame_xyzw"] = numbers(joint.channel_frame);
  }
  return out;
}

Joint joint_of(const json& value) {
  Joint joint;
  joint.name = value.at("name").get<std::string>();
  joint.parent = value.at("parent").get<int>();
  joint.offset_m = vector_of(value.at("offset_m"));
  joint.T_world_joint = rotation_of(value.at("T_xyzw"));
  if (value.contains("bone")) joint.bone = bone_from_name(value.at("bone").get<std::string>());
  if (value.contains("end_site_m")) joint.end_site_m = vector_of(value.at("end_site_m"));
  if (value.contains("channel_frame_xyzw")) {
    joint.channel_frame = rotation_of(value.at("channel_frame_xyzw"));
  }
  return joint;
}

bool is_possible(const Joint& joint) {
  return is_length(joint.offset_m) && is_rotation(joint.T_world_joint) &&
         is_rotation(joint.channel_frame) && (!joint.end_site_m || is_length(*joint.end_site_m));
}

}  // namespace

std::string skeleton_json(const Skeleton& skeleton) {
  json joints = json::array();
  for (const Joint& joint : skeleton.joints) joints.push_back(joint_json(joint));
  json channels = json::array();
  for (const Channel& channel : skeleton.channels) {
    channels.push_back({channel.joint, static_cast<int>(channel.axis), channel.translation});
  }
  return json_text(json{{"name", skeleton.name},
                        {"root_joint", skeleton.root_joint},
                        {"joints", std::move(joints)},
                        {"channels", std::move(channels)}});
}

Result<Skeleton> skeleton_from_json(std::string_view text, const std::string& name) {
  Skeleton skeleton;
  try {
    const json value = parse_json(text);
    if (value.is_discarded()) return fail("the skeleton of the clip is no JSON", name);
    skeleton.name = value.at("name").get<std::string>();
    skeleton.root_joint = value.at("root_joint").get<int>();
    for (const json& joint : value.at("joints")) skeleton.joints.push_back(joint_of(joint));
    for (const json& channel : value.at("channels")) {
      const auto axis = channel.at(1).get<unsigned>();
      if (axis > 2) return fail("the skeleton of the clip has a channel without an axis", name);
      skeleton.channels.push_back({.joint = channel.at(0).get<std::uint16_t>(),
                                   .axis = static_cast<Axis>(axis),
                                   .translation = channel.at(2).get<bool>()});
    }
  } catch (const json::exception& error) {
    return fail("the skeleton of the clip is damaged (" + std::string(error.what()) + ")", name);
  }
  for (const Joint& joint : skeleton.joints) {
    if (!is_possible(joint)) return fail("the skeleton of the clip has an impossible joint", name);
  }
  if (auto ok = skeleton.finish(); !ok) return fail(ok.error().message, name);
  return skeleton;
}

}  // namespace posed::clip
