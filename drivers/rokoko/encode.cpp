#include "drivers/rokoko/encode.hpp"

#include <lz4frame.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "drivers/decimals.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::rokoko {
namespace {

struct Place {
  std::string_view joint;  // without "left": the right side is its mirror image
  Vec3f from_parent_m;     // in T-pose, in posed's axes
};

constexpr std::array<Place, 34> kPlaces{{{"hip", {0.0F, 0.0F, 0.0F}},
                                         {"spine", {0.0F, 0.1F, 0.0F}},
                                         {"chest", {0.0F, 0.2F, 0.0F}},
                                         {"neck", {0.0F, 0.24F, 0.0F}},
                                         {"head", {0.0F, 0.1F, 0.02F}},
                                         {"Shoulder", {0.04F, 0.18F, 0.0F}},
                                         {"UpperArm", {0.14F, 0.0F, 0.0F}},
                                         {"LowerArm", {0.28F, 0.0F, 0.0F}},
                                         {"Hand", {0.26F, 0.0F, 0.0F}},
                                         {"ThumbProximal", {0.025F, -0.01F, 0.025F}},
                                         {"ThumbMedial", {0.032F, 0.0F, 0.032F}},
                                         {"ThumbDistal", {0.023F, 0.0F, 0.023F}},
                                         {"ThumbTip", {0.018F, 0.0F, 0.018F}},
                                         {"IndexProximal", {0.09F, 0.0F, 0.027F}},
                                         {"IndexMedial", {0.042F, 0.0F, 0.0F}},
                                         {"IndexDistal", {0.025F, 0.0F, 0.0F}},
                                         {"IndexTip", {0.02F, 0.0F, 0.0F}},
                                         {"MiddleProximal", {0.093F, 0.0F, 0.004F}},
                                         {"MiddleMedial", {0.046F, 0.0F, 0.0F}},
                                         {"MiddleDistal", {0.028F, 0.0F, 0.0F}},
                                         {"MiddleTip", {0.022F, 0.0F, 0.0F}},
                                         {"RingProximal", {0.088F, 0.0F, -0.017F}},
                                         {"RingMedial", {0.042F, 0.0F, 0.0F}},
                                         {"RingDistal", {0.026F, 0.0F, 0.0F}},
                                         {"RingTip", {0.021F, 0.0F, 0.0F}},
                                         {"LittleProximal", {0.081F, 0.0F, -0.036F}},
                                         {"LittleMedial", {0.033F, 0.0F, 0.0F}},
                                         {"LittleDistal", {0.02F, 0.0F, 0.0F}},
                                         {"LittleTip", {0.019F, 0.0F, 0.0F}},
                                         {"UpLeg", {0.09F, -0.06F, 0.0F}},
                                         {"Leg", {0.0F, -0.42F, 0.0F}},
                                         {"Foot", {0.0F, -0.41F, 0.0F}},
                                         {"Toe", {0.0F, -0.06F, 0.13F}},
                                         {"ToeEnd", {0.0F, 0.0F, 0.07F}}}};

Eigen::Vector3f from_parent_m(std::string_view joint) {
  const bool right = joint.starts_with("right");
  if (right) joint.remove_prefix(5);
  if (joint.starts_with("left")) joint.remove_prefix(4);
  for (const Place& place : kPlaces) {
    if (place.joint != joint) continue;
    const Vec3f& offset_m = right ? mirrored(place.from_parent_m) : place.from_parent_m;
    return {offset_m[0], offset_m[1], offset_m[2]};
  }
  return Eigen::Vector3f::Zero();
}

// Writes a number with seven decimals, which is faster than the shortest text; a place that lies
// beyond all rooms is cut. At most 19 characters.
char* put_number(char* at, float value) noexcept {
  constexpr double kMaxValue = 1e9;
  const double size =
      std::isfinite(value) ? std::min(std::abs(static_cast<double>(value)), kMaxValue) : 0.0;
  // Product and sum of a float are exact, so halves are rounded up.
  const auto parts = static_cast<std::int64_t>(size * 1e7 + 0.5);
  *at = '-';
  at += value < 0.0F && parts > 0 ? 1 : 0;
  return put_decimals<7>(at, parts);
}

char* put_text(char* at, std::string_view text) noexcept { return std::ranges::copy(text, at).out; }

template <std::size_t count>
char* put_numbers(char* at, const std::array<float, count>& values) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(at, &"{\"x\":,\"y\":,\"z\":,\"w\":"[5 * i], 5);
    at = put_number(at + 5, values[i]);
  }
  *at++ = '}';
  return at;
}

}  // namespace

void append_transform(std::string& json, const Vec3f& position_m, const Quatf& rotation_xyzw) {
  std::array<char, 256> text;
  char* at = put_numbers(put_text(text.data(), "\"position\":"), mirrored(position_m));
  at = put_numbers(put_text(at, ",\"rotation\":"), mirrored(rotation_xyzw));
  json.append(text.data(), at);
}

void append_joints(std::string& json, const Skeleton& skeleton, const Frame& frame) {
  std::array<Eigen::Quaternionf, kMaxJoints> rotation;
  std::array<Eigen::Vector3f, kMaxJoints> place;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const Eigen::Quaternionf turned =
        frame.valid[j] ? to_eigen(frame.rotation_xyzw[j]) : Eigen::Quaternionf::Identity();
    if (joint.parent < 0) {
      rotation[j] = turned;
      place[j] = Eigen::Map<const Eigen::Vector3f>(frame.root_position_m.data());
    } else {
      const std::size_t parent = joint.parent;
      rotation[j] = rotation[parent] * turned;
      place[j] = place[parent] + rotation[parent] * joint.offset_m.cast<float>();
    }
    json += j > 0 ? ",\"" : "\"";
    json += joint.name;
    json += "\":{";
    append_transform(json, {place[j].x(), place[j].y(), place[j].z()},
                     frame.valid[j] ? from_eigen(rotation[j]) : Quatf{});
    json += '}';
  }
}

Lz4Writer::Lz4Writer() {
  LZ4F_cctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createCompressionContext(&context, LZ4F_VERSION)) == 0) {
    context_.reset(context);
  }
}

void Lz4Writer::Free::operator()(LZ4F_cctx_s* context) const noexcept {
  (void)LZ4F_freeCompressionContext(context);
}

std::span<const std::byte> Lz4Writer::compress(std::string_view json) {
  constexpr std::size_t kBlockBytes = 64 * 1024;
  LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
  preferences.compressionLevel = -20;  // digits hardly compress, yet sixteen people fit a datagram
  preferences.autoFlush = 1;
  if (json.size() <= kBlockBytes) preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  const std::size_t room = LZ4F_compressFrameBound(json.size(), &preferences);
  if (bytes_.size() < room) bytes_.resize(room);
  std::size_t size = 0;
  const auto add = [&](std::size_t written) {
    const bool ok = LZ4F_isError(written) == 0;
    size += ok ? written : 0;
    return ok;
  };
  const LZ4F_compressOptions_t options{.stableSrc = 1, .reserved = {}};
  std::byte* const out = bytes_.data();
  const bool ok = context_ != nullptr &&
                  add(LZ4F_compressBegin(context_.get(), out, bytes_.size(), &preferences)) &&
                  add(LZ4F_compressUpdate(context_.get(), out + size, bytes_.size() - size,
                                          json.data(), json.size(), &options)) &&
                  add(LZ4F_compressEnd(context_.get(), out + size, bytes_.size() - size, &options));
  return {out, ok ? size : 0};
}

JointSet without_fingers() {
  JointSet joints;
  joints.set();
  return joints & ~fingers_of(kLeftHandJoint) & ~fingers_of(kRightHandJoint);
}

DescribedBody average_person(std::string_view name, const JointSet& joints, float scale) {
  DescribedBody body;
  body.key.name.keep(name);
  body.joints = joints;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    const int parent = studio_joint(j).parent;
    if (!joints[j] || parent < 0) continue;
    const Eigen::Quaternionf T_parent = to_eigen(t_pose_rotation(static_cast<std::size_t>(parent)));
    const Eigen::Vector3f offset_m =
        scale * (T_parent.conjugate() * from_parent_m(studio_joint(j).name));
    body.offset_m[j] = {offset_m.x(), offset_m.y(), offset_m.z()};
  }
  return body;
}

}  // namespace posed::drivers::rokoko
