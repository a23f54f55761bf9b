#include <algorithm>

#include "proto/clip/asf_parts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr double kInch_m = 0.0254;

// Adds translations in listed order, then the rotations reversed: posed lists the outermost first.
void add_channels(const AsfBone& bone, double radians, Acclaim& out) {
  AcclaimBone values{.name = bone.name, .channels = std::vector<int>(bone.dof.size())};
  const auto add = [&](std::size_t i, bool translation) {
    Channel channel;
    channel.joint = static_cast<std::uint16_t>(out.skeleton.joints.size() - 1);
    channel.axis = static_cast<Axis>(bone.dof[i][1] - 'x');
    channel.translation = translation;
    if (!bone.limits.empty()) {
      const double scale = translation ? out.metres_per_unit : radians;
      channel.min = static_cast<float>(bone.limits[i][0] * scale);
      channel.max = static_cast<float>(bone.limits[i][1] * scale);
    }
    values.channels[i] = static_cast<int>(out.skeleton.channels.size());
    out.skeleton.channels.push_back(channel);
  };
  for (std::size_t i = 0; i < bone.dof.size(); ++i) {
    if (bone.dof[i][0] == 't') add(i, true);
  }
  for (std::size_t i = bone.dof.size(); i-- > 0;) {
    if (bone.dof[i][0] == 'r') add(i, false);
  }
  out.bones.push_back(std::move(values));
}

// Recurses depth first. It ends, because a bone has at most one parent and the root none.
void add_bone(const AsfFile& file, int index, const AsfBone* parent, int parent_joint,
              Acclaim& out) {
  const AsfBone& bone = file.bones[index];
  const double radians = file.degrees ? kDegree : 1.0;
  Joint joint;
  joint.name = bone.name;
  joint.parent = parent_joint;
  joint.offset_m = out.metres_per_unit *
                   (parent != nullptr ? parent->direction * parent->length : file.root_position);
  if (bone.children.empty()) {
    joint.end_site_m = bone.direction * (bone.length * out.metres_per_unit);
  }
  for (std::size_t i = 0; i < bone.axis_order.size(); ++i) {  // the first letter is innermost
    const auto axis = static_cast<Axis>(bone.axis_order[i] - 'x');
    joint.channel_frame = axis_rotation(axis, bone.axis[static_cast<std::size_t>(axis)] * radians) *
                          joint.channel_frame;
  }
  const int here = static_cast<int>(out.skeleton.joints.size());
  out.skeleton.joints.push_back(std::move(joint));
  add_channels(bone, radians, out);
  for (const int child : bone.children) add_bone(file, child, &bone, here, out);
}

}  // namespace

Result<Acclaim> acclaim_of(const AsfFile& file, const std::string& name) {
  Acclaim out;
  out.metres_per_unit = kInch_m / file.length_unit;
  out.degrees = file.degrees;
  if (file.bones[0].dof.empty()) {
    return fail("the :root has no order, so nothing places the figure", name);
  }
  add_bone(file, 0, nullptr, -1, out);
  const auto lost = std::ranges::find_if(
      file.bones, [&out](const AsfBone& bone) { return out.skeleton.joint_index(bone.name) < 0; });
  if (lost != file.bones.end()) {
    return fail("bone " + in_quotes(lost->name) + " does not hang on the root in :hierarchy", name);
  }
  return out;
}

}  // namespace posed::clip
