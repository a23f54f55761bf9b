// A clip as FBX in text form, with what the files of various programs have: another unit, Z up, a
// turn before and after each joint's own, pivots, names with a prefix, an empty animation first.
#pragma once

#include <cstdint>
#include <functional>
#include <iomanip>
#include <sstream>
#include <string>

#include <Eigen/Geometry>

#include "proto/clip/clip.hpp"

namespace posed::test {

class FbxText {
 public:
  double centimetres_a_unit = 1.0;
  bool z_up = false;
  Eigen::Quaterniond pre = Eigen::Quaterniond::Identity(), post = Eigen::Quaterniond::Identity();
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  // [units of the file]
  std::string prefix;
  bool empty_stack = false, animated = true;
  int key_every = 1;  // frames
  int time_mode = 6;  // 30 frames a second; 0: the reader's usual rate; 14: one that is not named

  [[nodiscard]] std::string of(const clip::Clip& clip) {
    out_.str("");
    out_ << std::setprecision(12) << "; FBX 7.4.0 project file\n"
         << "FBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n}\n"
         << "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n";
    number("UpAxis", "int", z_up ? 2 : 1);
    number("UpAxisSign", "int", 1);
    number("FrontAxis", "int", z_up ? 1 : 2);
    number("FrontAxisSign", "int", z_up ? -1 : 1);
    number("CoordAxis", "int", 0);
    number("CoordAxisSign", "int", 1);
    number("UnitScaleFactor", "double", centimetres_a_unit);
    number("TimeMode", "enum", time_mode);
    out_ << "\t}\n}\nObjects:  {\n";
    links_.clear();
    if (empty_stack) stack(1, "Take 001");
    stack(10, "mixamo.com");
    for (int j = 0; j < static_cast<int>(clip.skeleton->joints.size()); ++j) joint(clip, j);
    out_ << "}\nConnections:  {\n" << links_ << "}\n";
    return out_.str();
  }

 private:
  struct Place {
    Eigen::Vector3d translation;
    Eigen::Vector3d degrees;
  };

  void number(const char* name, const char* type, double value) {
    out_ << "\t\tP: \"" << name << "\", \"" << type << "\", \"\", \"\"," << value << "\n";
  }
  void vector(const char* name, const Eigen::Vector3d& v) {
    out_ << "\t\t\tP: \"" << name << "\", \"Vector3D\", \"Vector\", \"\"," << v.x() << "," << v.y()
         << "," << v.z() << "\n";
  }
  void stack(int id, const char* name) {
    out_ << "\tAnimationStack: " << id << ", \"AnimStack::" << name << "\", \"\" {\n\t}\n"
         << "\tAnimationLayer: " << id + 1 << ", \"AnimLayer::BaseLayer\", \"\" {\n\t}\n";
    link(id + 1, id);
  }
  void link(int from, int to, const std::string& property = "") {
    links_ += "\tC: \"" + std::string(property.empty() ? "OO" : "OP") + "\"," +
              std::to_string(from) + "," + std::to_string(to) +
              (property.empty() ? "" : ", \"" + property + "\"") + "\n";
  }

  // Angles about x, y and z, x innermost, as FBX has them where nothing is said.
  static Eigen::Vector3d degrees_of(const Eigen::Quaterniond& q) {
    return Eigen::Vector3d(q.toRotationMatrix().eulerAngles(2, 1, 0).reverse()) * (180.0 / M_PI);
  }

  // Translation and rotation of a joint so that with pivot, pre- and post-rotation it is where the
  // clip has it: M = T Rp Pre R Post^-1 Rp^-1.
  [[nodiscard]] Place place(const Skeleton& skeleton, int j, const Eigen::Vector3d& at_m,
                            const Eigen::Quaterniond& turn) const {
    const bool root = skeleton.joints[static_cast<std::size_t>(j)].parent < 0;
    Eigen::Quaterniond up = Eigen::Quaterniond::Identity();
    if (root && z_up) up = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX());
    const Eigen::Quaterniond local = up * turn;
    const Eigen::Vector3d at = up * (at_m * (100.0 / centimetres_a_unit));
    return {.translation = at - pivot + local * pivot,
            .degrees = degrees_of(pre.conjugate() * local * post)};
  }

  void joint(const clip::Clip& clip, int j) {
    const Skeleton& skeleton = *clip.skeleton;
    const Joint& joint = skeleton.joints[static_cast<std::size_t>(j)];
    const int id = 1000 * (j + 1);
    const Place rest = place(skeleton, j, joint.offset_m, Eigen::Quaterniond::Identity());
    out_ << "\tModel: " << id << ", \"Model::" << prefix << joint.name
         << "\", \"LimbNode\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n";
    vector("PreRotation", degrees_of(pre));
    vector("PostRotation", degrees_of(post));
    vector("RotationPivot", pivot);
    vector("Lcl Translation", rest.translation);
    vector("Lcl Rotation", rest.degrees);
    out_ << "\t\t}\n\t}\n\tNodeAttribute: " << id + 1
         << ", \"NodeAttribute::\", \"LimbNode\" {\n\t\tTypeFlags: \"Skeleton\"\n\t}\n";
    link(id + 1, id);
    link(id, joint.parent < 0 ? 0 : 1000 * (joint.parent + 1));
    if (!animated) return;
    const auto row_of = [&](int frame) {
      const auto row = clip.channels.row(frame);
      return std::span<const double>(row.data(), static_cast<std::size_t>(row.size()));
    };
    const auto at = [&](int frame) {
      const auto channels = posed::channels_of(skeleton, j);
      const auto first = channels.data() - skeleton.channels.data();
      return place(skeleton, j, local_position(joint, channels, row_of(frame).data() + first),
                   local_rotation(skeleton, j, row_of(frame)));
    };
    curves(id, id + 10, "Lcl Translation", clip, [&](int i) { return at(i).translation; });
    curves(id, id + 20, "Lcl Rotation", clip, [&](int i) { return at(i).degrees; });
  }

  void curves(int joint, int id, const char* property, const clip::Clip& clip,
              const std::function<Eigen::Vector3d(int)>& value) {
    out_ << "\tAnimationCurveNode: " << id << ", \"AnimCurveNode::T\", \"\" {\n\t}\n";
    link(id, 11);
    link(id, joint, property);
    for (int axis = 0; axis < 3; ++axis) {
      const int curve = id + 1 + axis;
      const int keys = (clip.frames() - 1) / key_every + 1;
      const std::string count = "*" + std::to_string(keys) + " {\n\t\t\ta: ";
      out_ << "\tAnimationCurve: " << curve << ", \"AnimCurve::\", \"\" {\n\t\tDefault: 0\n"
           << "\t\tKeyVer: 4008\n\t\tKeyTime: " << count;
      for (int i = 0; i < clip.frames(); i += key_every) {
        constexpr double kTicksASecond = 46186158000.0;
        out_ << (i > 0 ? "," : "")
             << static_cast<std::int64_t>(i / clip.frame_rate_hz * kTicksASecond);
      }
      out_ << "\n\t\t}\n\t\tKeyValueFloat: " << count;
      for (int i = 0; i < clip.frames(); i += key_every)
        out_ << (i > 0 ? "," : "") << value(i)[axis];
      out_ << "\n\t\t}\n\t}\n";
      link(curve, id, std::string("d|") + "XYZ"[axis]);
    }
  }

  std::ostringstream out_;
  std::string links_;
};

}  // namespace posed::test
