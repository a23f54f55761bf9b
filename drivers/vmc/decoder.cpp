#include "drivers/vmc/decoder.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/pose_values.hpp"
#include "drivers/vmc/axes.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::vmc {
namespace {

constexpr std::string_view kBoneAddress = "/VMC/Ext/Bone/Pos";
constexpr std::string_view kRootAddress = "/VMC/Ext/Root/Pos";
constexpr std::string_view kApplyAddress = "/VMC/Ext/Blend/Apply";
constexpr std::string_view kStatusAddress = "/VMC/Ext/OK";
constexpr std::string_view kTimeAddress = "/VMC/Ext/T";
constexpr std::string_view kAvatarAddress = "/VMC/Ext/VRM";
constexpr std::string_view kNoBone = "LastBone";  // the end of Unity's list, which some send, too

// The tolerance of the squared length: some senders round the components, or are 1 % too long.
constexpr double kLengthTolerance = 0.05;

constexpr std::int64_t kKeeps_ns = kNanosPerSecond;  // as long as the describer keeps a bone

struct Transform {
  std::string_view name;
  Vec3f position_m{};
  Quatf rotation_xyzw{};
  bool seen = false;  // the rotation is not all zero
};

// In posed's axes; false for missing or mistyped arguments and for what is no position or no
// rotation.
RT_SAFE bool read_transform(OscArguments& arguments, Transform& transform) noexcept {
  transform.name = arguments.text();
  for (float& x_m : transform.position_m) x_m = arguments.f32();
  for (float& x : transform.rotation_xyzw) x = arguments.f32();
  if (!arguments.ok() || !is_plausible(transform.position_m)) return false;
  if (!accept_rotation(transform.rotation_xyzw, transform.seen, kLengthTolerance)) return false;
  transform.position_m = mirrored(transform.position_m);
  transform.rotation_xyzw = mirrored(transform.rotation_xyzw);
  return true;
}

RT_SAFE bool is_metacarpal(std::string_view name) noexcept {
  return name.ends_with("ThumbMetacarpal");
}

}  // namespace

RT_SAFE void Describer::frame(const std::bitset<kBoneCount>& bones,
                              const std::array<Vec3f, kBoneCount>& position_m,
                              std::int64_t arrival_ns) noexcept {
  grown_ = grown_ || (bones & ~bones_).any();
  bones_ |= bones;
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (!bones[bone]) continue;
    last_ns_[bone] = arrival_ns;
    // The hips' position is where the body is.
    if (bone != kHips) offset_m_[bone] = position_m[bone];
  }
}

RT_SAFE void Describer::title(std::string_view text) noexcept {
  if (text.size() > title_.size()) return;
  std::ranges::copy(text, title_.begin());
  title_size_ = text.size();
}

RT_SAFE void Describer::forget_bones(std::int64_t now_ns) noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (now_ns - last_ns_[bone] >= kGone_ns) bones_.reset(bone);
  }
}

RT_SAFE bool Describer::is_gone(const Values& values, std::int64_t now_ns) const noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (bones_[bone] && now_ns - last_ns_[bone] < kGone_ns) return false;
  }
  return values.last_ns() == kNoTime_ns || now_ns - values.last_ns() >= kGone_ns;
}

RT_SAFE bool Describer::has_moved() const noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (!bones_[bone]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::abs(offset_m_[bone][i] - described_.offset_m[bone][i]) > kMoved_m) return true;
    }
  }
  return false;
}

RT_SAFE void Describer::update(Values& values, std::int64_t now_ns, Sink& sink) noexcept {
  forget_bones(now_ns);
  if (values.consume_new()) {
    grown_ = true;
    values_new_ = true;
  }
  steady_ = std::exchange(grown_, false) ? 0 : std::min(steady_ + 1, kSteady);
  const bool there = !is_gone(values, now_ns);
  const bool changed = there != there_ || bones_ != described_.bones || (there && values_new_);
  if (steady_ < kSteady || !(changed || has_moved())) return;
  if (described_ns_ != kNoTime_ns) {
    const std::int64_t since_ns = now_ns - described_ns_;
    if (since_ns > 2 * kMaxInterval_ns || changed) between_moves_ns_ = kBetween_ns;
    if (since_ns < between_moves_ns_) return;
    if (!changed) between_moves_ns_ = std::min(2 * between_moves_ns_, kMaxInterval_ns);
  }
  there_ = there;
  describe(values, now_ns, sink);
}

RT_SAFE void Describer::describe(const Values& values, std::int64_t now_ns, Sink& sink) noexcept {
  described_.title = {title_.data(), title_size_};
  described_.bones = bones_;
  described_.offset_m = offset_m_;
  described_.value_count = 0;
  if (there_) values.describe(now_ns, described_);
  described_ns_ = now_ns;
  values_new_ = false;
  sink.description(write_description(described_, bytes_));
}

RT_SAFE void VmcDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                              Sink& sink) noexcept {
  arrival_ns_ = active_time_.to(arrival_ns);
  Outcome outcome = check_packet(bytes);
  if (outcome == Outcome::kOk) outcome = accept_packet(bytes, sink);
  sink.outcome(outcome);
}

RT_SAFE Outcome VmcDecoder::accept_packet(std::span<const std::byte> packet, Sink& sink) noexcept {
  worst_ = Outcome::kOk;
  ended_ = false;
  received_.reset();
  const std::int64_t before_ns = clock_.device_ns();
  const Survey found = survey(packet);
  if (found.any && !found.of_vmc) return Outcome::kForeign;
  if (found.time == Outcome::kLate) return Outcome::kLate;
  note(found.time);
  std::bitset<kBoneCount> bones;
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) bones[bone] = found.received.messages[bone];
  if ((bones & set_).any()) {
    end_.missed();
    end_frame(before_ns, sink);
  }
  const bool all_read = each_message(packet, [this](const OscMessage& message) noexcept {
    if (!accept_message(message)) note(Outcome::kOutOfRange);
  });
  if (!all_read) note(Outcome::kOutOfRange);
  if (end_.ends(found.received, arrival_ns_, set_.any())) end_frame(clock_.device_ns(), sink);
  const bool batch_is_over = set_.none() && (applied_ || ended_);
  if (batch_is_over && values_.fresh()) emit_sample(sink);
  if (batch_is_over || describer_.is_gone(values_, arrival_ns_)) {
    describer_.update(values_, arrival_ns_, sink);
  }
  if (batch_is_over) applied_ = false;
  return worst_;
}

// The thumb's first joint is Proximal in VRM 0, as in Unity, and Metacarpal in VRM 1, where
// Proximal is the second. Who names a Metacarpal once has VRM 1's names.
RT_SAFE std::size_t VmcDecoder::bone_of(std::string_view name) const noexcept {
  if (!has_vrm1_names_) return find_bone(name);
  const bool is_left = name.starts_with("Left") || name.starts_with("left");
  if (is_metacarpal(name)) return find_bone(is_left ? "LeftThumbProximal" : "RightThumbProximal");
  if (name.ends_with("ThumbProximal")) {
    return find_bone(is_left ? "LeftThumbIntermediate" : "RightThumbIntermediate");
  }
  return find_bone(name);
}

RT_SAFE VmcDecoder::Survey VmcDecoder::survey(std::span<const std::byte> packet) noexcept {
  Survey found;
  const bool all_read = each_message(packet, [&](const OscMessage& message) noexcept {
    found.any = true;
    found.of_vmc = found.of_vmc || message.address.starts_with(kAddressPrefix);
    OscArguments arguments(message);
    if (message.address == kBoneAddress) {
      const std::string_view name = arguments.text();
      has_vrm1_names_ = has_vrm1_names_ || is_metacarpal(name);
      const std::size_t bone = bone_of(name);
      if (bone < kBoneCount) found.received.add(bone);
    } else if (message.address == kStatusAddress) {
      found.received.add(kOkMessage);
    } else if (message.address == kTimeAddress) {
      found.received.add(kTimeMessage);
      const float time_s = arguments.f32();
      found.time = arguments.ok() ? clock_.accept(time_s) : Outcome::kOutOfRange;
    }
  });
  found.any = found.any || !all_read;
  return found;
}

RT_SAFE bool VmcDecoder::accept_message(const OscMessage& message) noexcept {
  OscArguments arguments(message);
  if (message.address == kBoneAddress) return accept_bone(arguments);
  if (message.address == kRootAddress) return accept_root(arguments);
  if (message.address == address_of(ValueKind::kBlend)) return accept_blend(arguments);
  if (message.address == kStatusAddress) return accept_status(arguments);
  if (message.address == kAvatarAddress) return accept_avatar(arguments);
  for (const ValueKind kind : {ValueKind::kHeadSet, ValueKind::kController, ValueKind::kTracker}) {
    if (message.address == address_of(kind)) return accept_device(kind, arguments);
  }
  if (message.address == kApplyAddress) applied_ = true;
  return true;  // all others mean nothing to posed
}

RT_SAFE bool VmcDecoder::accept_bone(OscArguments& arguments) noexcept {
  Transform transform;
  const bool valid = read_transform(arguments, transform);
  if (transform.name == kNoBone) return true;
  const std::size_t bone = bone_of(transform.name);
  if (!valid || bone == kBoneCount || received_[bone]) return false;
  received_.set(bone);
  set_.set(bone);
  keeps_until_ns_[bone] = transform.seen ? arrival_ns_ + kKeeps_ns : kNoTime_ns;
  position_m_[bone] = transform.position_m;
  rotation_xyzw_[bone] = transform.rotation_xyzw;
  return true;
}

RT_SAFE bool VmcDecoder::accept_root(OscArguments& arguments) noexcept {
  Transform transform;
  if (!read_transform(arguments, transform)) return false;
  root_m_ = transform.position_m;
  root_xyzw_ = transform.rotation_xyzw;
  root_seen_ = transform.seen;
  return true;
}

RT_SAFE bool VmcDecoder::accept_blend(OscArguments& arguments) noexcept {
  const std::string_view name = arguments.text();
  const float value = arguments.f32();
  if (!arguments.ok() || !std::isfinite(value)) return false;
  values_.set(ValueKind::kBlend, name, std::span(&value, 1), arrival_ns_);
  return true;
}

RT_SAFE bool VmcDecoder::accept_device(ValueKind kind, OscArguments& arguments) noexcept {
  Transform transform;
  if (!read_transform(arguments, transform)) return false;
  if (!transform.seen) return true;  // it is not tracked
  const Vec3f& at = transform.position_m;
  const Quatf& q = transform.rotation_xyzw;
  const std::array<float, 7> values{at[0], at[1], at[2], q[0], q[1], q[2], q[3]};
  values_.set(kind, transform.name, values, arrival_ns_);
  return true;
}

RT_SAFE bool VmcDecoder::accept_status(OscArguments& arguments) noexcept {
  constexpr std::size_t kWithTracking = 4;
  const bool with_tracking = arguments.left() >= kWithTracking;
  const bool loaded = arguments.number() != 0.0;
  bool tracking = true;
  for (std::size_t i = 1; i < kWithTracking && with_tracking; ++i)
    tracking = arguments.number() != 0.0;
  if (!arguments.ok()) return false;
  if (!loaded) keeps_until_ns_.fill(kNoTime_ns);
  loaded_ = loaded;
  tracking_ = tracking;
  return true;
}

RT_SAFE bool VmcDecoder::accept_avatar(OscArguments& arguments) noexcept {
  (void)arguments.text();  // the path of its file
  const std::string_view title = arguments.text();
  if (!arguments.ok()) return false;
  describer_.title(title);
  return true;
}

RT_SAFE void VmcDecoder::end_frame(std::int64_t device_ns, Sink& sink) noexcept {
  ended_ = true;
  // A model that is not loaded has no pose; what is sent for it describes nobody.
  if (loaded_) describer_.frame(set_, position_m_, arrival_ns_);
  if (!loaded_ || layout_ == nullptr || layout_->skeleton() == nullptr) {
    note(Outcome::kForeign);
  } else if (!emit_frame(device_ns, sink)) {
    note(Outcome::kOutOfRange);
  }
  set_.reset();
}

// False if the body would be out of the room.
RT_SAFE bool VmcDecoder::emit_frame(std::int64_t device_ns, Sink& sink) noexcept {
  const Skeleton& skeleton = *layout_->skeleton();
  Frame frame;
  frame.header.device_ns = device_ns;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  frame.quality = tracking_ ? Quality::kMeasured : Quality::kHeld;
  for (std::size_t j = 0; j < frame.joint_count; ++j) frame.rotation_xyzw[j] = kIdentity;
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    const int joint = layout_->joint_of[bone];
    if (joint == VmcLayout::kNone || arrival_ns_ >= keeps_until_ns_[bone]) continue;
    if (!set_[bone] && !left_out_[bone]) {
      left_out_.set(bone);
      continue;
    }
    frame.rotation_xyzw[joint] = rotation_xyzw_[bone];
    frame.valid.set(joint);
  }
  // The room's transform, then the hips. A sender without hips moves the body by its root alone.
  const bool placed = layout_->hips_sent ? frame.valid[kHips] : root_seen_;
  frame.valid[kHips] = placed;
  const Eigen::Quaternionf root = to_eigen(root_xyzw_);
  if (placed) {
    const Eigen::Quaternionf hips = to_eigen(frame.rotation_xyzw[kHips]);
    frame.rotation_xyzw[kHips] = from_eigen((root * hips).normalized());
  }
  const Vec3f& hips_m = position_m_[kHips];
  const Eigen::Vector3f at_m = root * Eigen::Vector3f(hips_m[0], hips_m[1], hips_m[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    frame.root_position_m[i] = root_m_[i] + at_m[static_cast<Eigen::Index>(i)];
  }
  if (!is_plausible(frame.root_position_m)) return false;
  sink.frame(0, frame);
  return true;
}

RT_SAFE void VmcDecoder::emit_sample(Sink& sink) noexcept {
  if (!loaded_ || layout_ == nullptr || layout_->value_count == 0) return;
  Sample sample;
  sample.header.device_ns = clock_.device_ns();
  sample.quality = tracking_ ? Quality::kMeasured : Quality::kHeld;
  values_.fill(sample);
  sink.sample(0, sample);
}

}  // namespace posed::drivers::vmc
