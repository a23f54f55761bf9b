#include "proto/frame/skeleton.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <zlib.h>

#include "proto/rig/live.hpp"
#include "proto/text/clean.hpp"

namespace posed {
namespace {

// The content of a skeleton as bytes, for its id. Lengths and rotations are rounded to 1e-6, so
// that two machines whose maths libraries differ in the last bit compute the same id.
class Content {
 public:
  void add(std::string_view text) { bytes_.append(text).push_back('\0'); }
  void add(double value) {
    const auto rounded = static_cast<std::int64_t>(std::llround(value * 1e6));
    for (int shift = 0; shift < 64; shift += 8) {
      bytes_.push_back(static_cast<char>((rounded >> shift) & 0xFF));
    }
  }
  void add(const Eigen::Quaterniond& q) {
    const double sign = q.w() < 0 ? -1.0 : 1.0;
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) add(sign * value);
  }
  [[nodiscard]] std::uint32_t crc() const {
    return static_cast<std::uint32_t>(crc32_z(
        crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes_.data()), bytes_.size()));
  }

 private:
  std::string bytes_;
};

// True when the joint has position channels.
bool moves(const Skeleton& skeleton, int joint) {
  return std::ranges::any_of(skeleton.channels, [joint](const Channel& channel) {
    return channel.joint == joint && channel.translation;
  });
}

std::uint32_t content_id(const Skeleton& skeleton) {
  Content content;
  content.add(skeleton.root_joint);
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const Joint& joint = skeleton.joints[j];
    content.add(joint.name);
    content.add(joint.parent);
    // Files write a take's start position into the OFFSET of the root: not part of the figure.
    const bool says_where = j <= skeleton.root_joint && moves(skeleton, j);
    for (int i = 0; i < 3 && !says_where; ++i) content.add(joint.offset_m[i]);
    content.add(joint.bone ? bone_name(*joint.bone) : std::string_view());
    content.add(joint.channel_frame);
    content.add(joint.T_world_joint);
  }
  for (const Channel& channel : skeleton.channels) {
    content.add(channel.joint);
    content.add(static_cast<int>(channel.axis) + (channel.translation ? 3 : 0));
  }
  for (const JointCapsule& capsule : skeleton.capsules) {
    content.add(capsule.joint);
    for (const double value : capsule.from_m) content.add(value);
    for (const double value : capsule.to_m) content.add(value);
    content.add(capsule.radius_m);
  }
  return content.crc();
}

Result<> check_joints(const Skeleton& skeleton) {
  if (skeleton.joints.empty()) return fail("the skeleton has no joints");
  if (skeleton.joints.size() > static_cast<std::size_t>(kMaxJoints)) {
    return fail("the skeleton has " + std::to_string(skeleton.joints.size()) +
                " joints; posed carries at most " + std::to_string(kMaxJoints) +
                ": leave out joints that do not matter, for example finger tips");
  }
  if (skeleton.root_joint < 0 || skeleton.root_joint >= std::ssize(skeleton.joints)) {
    return fail("the skeleton's root joint is not one of its joints");
  }
  std::set<std::string_view> names;
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const Joint& joint = skeleton.joints[j];
    if (joint.name.empty()) return fail("joint " + std::to_string(j) + " has no name");
    if (!names.insert(joint.name).second) {
      return fail("two joints are named " + in_quotes(joint.name) + "; give each its own name");
    }
    if (joint.parent >= j || joint.parent < -1 || (joint.parent == -1) != (j == 0)) {
      return fail("joint " + in_quotes(joint.name) + " does not stand after its parent");
    }
    if (!joint.offset_m.allFinite() || joint.offset_m.cwiseAbs().maxCoeff() > 1e6) {
      return fail("the offset of joint " + in_quotes(joint.name) + " is not a length");
    }
  }
  return {};
}

Result<> check_channels(const Skeleton& skeleton) {
  int rotations = 0;
  int before = 0;
  unsigned seen = 0;  // bit: axis, + 3 for a translation
  for (const Channel& channel : skeleton.channels) {
    if (channel.joint >= skeleton.joints.size() || channel.joint < before) {
      return fail("the skeleton's channels do not follow the order of its joints");
    }
    if (channel.joint != before) seen = 0;
    before = channel.joint;
    const unsigned bit =
        1U << (static_cast<unsigned>(channel.axis) + (channel.translation ? 3 : 0));
    if ((seen & bit) != 0) {
      return fail("joint " + in_quotes(skeleton.joints[channel.joint].name) +
                  " lists a channel twice");
    }
    seen |= bit;
    rotations += channel.translation ? 0 : 1;
  }
  if (rotations > kMaxChannels) {
    return fail("the skeleton has " + std::to_string(rotations) +
                " rotation channels; posed carries at most " + std::to_string(kMaxChannels));
  }
  return {};
}

// q * v, bit for bit as Eigen computes it, but inlined: Eigen's call would take a sixth of the time
// of a glove's packet.
RT_SAFE Eigen::Vector3d turned(const Eigen::Quaterniond& q, const Eigen::Vector3d& v) noexcept {
  const Eigen::Vector3d axis = q.vec();
  const Eigen::Vector3d across = 2.0 * axis.cross(v);
  return v + q.w() * across + axis.cross(across);
}

// L = C M C^-1, where M is the product in listed order, first outermost. Not finite when a channel
// is not finite.
RT_SAFE Eigen::Quaterniond local_rotation(const Joint& joint, std::span<const Channel> channels,
                                          const double* values) noexcept {
  Eigen::Quaterniond m = Eigen::Quaterniond::Identity();
  bool any = false;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    // Most channels of a glove's hand are zero and rotate nothing; skipping them halves the time
    // per packet.
    if (channels[i].translation || values[i] == 0.0) continue;
    const Eigen::Quaterniond turn = axis_rotation(channels[i].axis, values[i]);
    m = any ? m * turn : turn;
    any = true;
  }
  // C M C^-1 rotates M's axis by C and keeps its angle.
  if (any) m.vec() = turned(joint.channel_frame, m.vec());
  return m;
}

// The product of rotations about axes a and b that is closest to q: dot(q, qa(x) qb(y)) is bilinear
// in the (cos, sin) of the half angles, so the optimum is the top singular pair of a 2 x 2 matrix.
std::array<double, 3> two_axes(const Eigen::Quaterniond& q, int a, int b) {
  const double cyclic = (b - a + 3) % 3 == 1 ? 1.0 : -1.0;
  const int c = 3 - a - b;
  Eigen::Matrix2d m;
  m << q.w(), q.vec()[b], q.vec()[a], cyclic * q.vec()[c];
  const double half_b = 0.5 * std::atan2(2 * (m(0, 0) * m(0, 1) + m(1, 0) * m(1, 1)),
                                         m.col(0).squaredNorm() - m.col(1).squaredNorm());
  const Eigen::Vector2d u = m * Eigen::Vector2d(std::cos(half_b), std::sin(half_b));
  return {2 * std::atan2(u[1], u[0]), 2 * half_b, 0.0};
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::abs(a[i] - b[i]);
  return sum;
}

std::array<double, 3> unwrap_near(std::array<double, 3> angles, const std::array<double, 3>& near) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(angles[i] - near[i]) < 3.0) continue;  // within half a turn
    angles[i] = posed::unwrap_near(angles[i], near[i]);
  }
  return angles;
}

// Solves R = Ri(x) Rj(y) Rk(z) for three different axes. Of the two solutions it returns the one
// nearest to `near`; at gimbal lock x keeps its value from `near`.
std::array<double, 3> three_axes(const Eigen::Quaterniond& q, int i, int j, int k,
                                 const std::array<double, 3>& near) {
  const Eigen::Matrix3d r = q.toRotationMatrix();
  const double e = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;
  const double cosine = std::sqrt(r(i, i) * r(i, i) + r(i, j) * r(i, j));
  const double middle = std::atan2(e * r(i, k), cosine);
  if (cosine < 1e-9) {
    const Eigen::Quaterniond rest = axis_rotation(static_cast<Axis>(j), -middle) *
                                    axis_rotation(static_cast<Axis>(i), -near[0]) * q;
    return unwrap_near({near[0], middle, twist_angle_rad(rest, unit(static_cast<Axis>(k)))}, near);
  }
  const double x = std::atan2(-e * r(j, k), r(k, k));
  const double z = std::atan2(-e * r(i, j), r(i, i));
  constexpr double kPi = std::numbers::pi;
  const auto one = unwrap_near(std::array{x, middle, z}, near);
  // The other is half a turn away in two of them.
  if (distance(one, near) < kPi) return one;
  const auto other = unwrap_near(std::array{x + kPi, kPi - middle, z + kPi}, near);
  return distance(one, near) <= distance(other, near) ? one : other;
}

}  // namespace

int Skeleton::joint_index(std::string_view joint_name) const {
  const auto at = std::ranges::find(joints, joint_name, &Joint::name);
  return at == joints.end() ? -1 : static_cast<int>(at - joints.begin());
}

int Skeleton::joint_of(Bone bone) const {
  const auto at = std::ranges::find(joints, std::optional<Bone>(bone), &Joint::bone);
  return at == joints.end() ? -1 : static_cast<int>(at - joints.begin());
}

Result<> Skeleton::finish() {
  TRY(check_joints(*this));
  TRY(check_channels(*this));
  // A robot is nobody, whatever its joints are called.
  const bool robot = !capsules.empty();
  if (!robot && std::ranges::none_of(joints, [](const Joint& j) { return j.bone.has_value(); })) {
    const rig::Rig rig = rig::recognise(*this);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      joints[j].bone = rig.bone[j];
      joints[j].T_world_joint = rig.T[j];
    }
  }
  id = content_id(*this);
  return {};
}

Eigen::Quaterniond local_rotation(const Skeleton& skeleton, int joint,
                                  std::span<const double> values) noexcept {
  const std::span<const Channel> channels = channels_of(skeleton, joint);
  const std::size_t first = channels.data() - skeleton.channels.data();
  if (first + channels.size() > values.size()) return Eigen::Quaterniond::Identity();
  return local_rotation(skeleton.joints[joint], channels, values.data() + first);
}

void pose_from_channels(const Skeleton& skeleton, std::span<const double> values,
                        Frame& frame) noexcept {
  const auto joint_count = std::min<std::size_t>(skeleton.joints.size(), kMaxJoints);
  const std::size_t channel_count = std::min(skeleton.channels.size(), values.size());
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(joint_count);
  frame.valid.reset();
  std::uint16_t angle_count = 0;
  std::size_t c = 0;
  for (std::size_t j = 0; j < joint_count; ++j) {
    const std::size_t first = c;
    while (c < channel_count && skeleton.channels[c].joint == j) {
      if (!skeleton.channels[c].translation && angle_count < kMaxChannels) {
        frame.angle_rad[angle_count++] = static_cast<float>(values[c]);
      }
      ++c;
    }
    const std::span<const Channel> channels(skeleton.channels.data() + first, c - first);
    const Eigen::Quaterniond q =
        local_rotation(skeleton.joints[j], channels, values.data() + first);
    const Eigen::Vector3d p = local_position(skeleton.joints[j], channels, values.data() + first);
    const bool measured = q.coeffs().allFinite() && p.allFinite();
    frame.valid[j] = measured;
    frame.rotation_xyzw[j] = measured ? from_eigen(q) : kIdentity;
  }
  frame.angle_count = angle_count;

  Eigen::Vector3d root = Eigen::Vector3d::Zero();
  for (int j = skeleton.root_joint; j >= 0; j = skeleton.joints[j].parent) {
    const Joint& joint = skeleton.joints[j];
    const std::span<const Channel> channels = channels_of(skeleton, j);
    const std::size_t first = channels.data() - skeleton.channels.data();
    if (first + channels.size() > values.size()) return;
    if (j != skeleton.root_joint) {
      root = local_rotation(joint, channels, values.data() + first) * root;
    }
    root += local_position(joint, channels, values.data() + first);
  }
  if (root.allFinite()) {
    for (int i = 0; i < 3; ++i) {
      frame.root_position_m[i] = static_cast<float>(root[i]);
    }
  }
}

std::array<double, 3> channels_from_rotation(const Skeleton& skeleton, int joint,
                                             const Eigen::Quaterniond& rotation,
                                             const std::array<double, 3>& near_rad) {
  const Eigen::Quaterniond& c = skeleton.joints[joint].channel_frame;
  const bool own = c.w() == 1.0;  // the joint's
  const Eigen::Quaterniond m = (own ? rotation : c.conjugate() * rotation * c).normalized();
  std::array<int, 3> axes{};
  std::size_t count = 0;
  for (const Channel& channel : channels_of(skeleton, joint)) {
    if (!channel.translation) axes[count++] = static_cast<int>(channel.axis);
  }
  if (count == 3) return three_axes(m, axes[0], axes[1], axes[2], near_rad);
  if (count == 2) return unwrap_near(two_axes(m, axes[0], axes[1]), near_rad);
  if (count == 1) {
    return unwrap_near({2 * std::atan2(m.vec()[axes[0]], m.w()), 0.0, 0.0}, near_rad);
  }
  return {};
}

void set_rotation(const Skeleton& skeleton, int joint, const Eigen::Quaterniond& rotation,
                  Frame& frame) noexcept {
  frame.rotation_xyzw[joint] = from_eigen(rotation.normalized());
  if (frame.angle_count == 0) return;
  const auto turns = [](const Channel& channel) { return !channel.translation; };
  const std::span<const Channel> channels = channels_of(skeleton, joint);
  float* const angles =
      frame.angle_rad.data() + std::count_if(skeleton.channels.data(), channels.data(), turns);
  const std::size_t count = std::ranges::count_if(channels, turns);
  std::array<double, 3> near_rad{};
  // An angle that was not measured is no guide.
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isfinite(angles[i])) near_rad[i] = static_cast<double>(angles[i]);
  }
  const auto turned = channels_from_rotation(skeleton, joint, rotation, near_rad);
  for (std::size_t i = 0; i < count; ++i) angles[i] = static_cast<float>(turned[i]);
}

}  // namespace posed
