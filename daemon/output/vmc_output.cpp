#include "daemon/output/vmc_output.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/vmc/bones.hpp"
#include "drivers/vmc/protocol.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::output {
namespace {

namespace vmc = drivers::vmc;

constexpr Bone wrist_of(Side side) noexcept {
  return side == Side::kLeft ? Bone::kLeftHand : Bone::kRightHand;
}
constexpr bool is_finger(Side side, Bone bone) noexcept {
  return bone >= hand_bone(side, 0) && bone <= hand_bone(side, kHandJoints - 1);
}
constexpr bool is_of_hand(Side side, Bone bone) noexcept {
  return bone == wrist_of(side) || is_finger(side, bone);
}

// Where the part begins.
constexpr Bone top_of(Part part) noexcept {
  if (part == Part::kBody) return Bone::kHips;
  return wrist_of(part == Part::kLeftHand ? Side::kLeft : Side::kRight);
}

std::optional<std::size_t> sent_bone(Bone bone) noexcept {
  const auto& table = vmc::bone_table();
  const auto found = std::ranges::find(table, std::optional(bone), &vmc::BoneEntry::bone);
  if (found == table.end()) return std::nullopt;
  return static_cast<std::size_t>(found - table.begin());
}

struct Preset {
  std::string_view vrm0, vrm1;
};

// VRM 0 as Unity's programs spell it. VRM 1's "surprised" has no counterpart.
constexpr std::array<Preset, 17> kPresets{{{"Joy", "happy"},
                                           {"Angry", "angry"},
                                           {"Sorrow", "sad"},
                                           {"Fun", "relaxed"},
                                           {"Neutral", "neutral"},
                                           {"A", "aa"},
                                           {"I", "ih"},
                                           {"U", "ou"},
                                           {"E", "ee"},
                                           {"O", "oh"},
                                           {"Blink", "blink"},
                                           {"Blink_L", "blinkLeft"},
                                           {"Blink_R", "blinkRight"},
                                           {"LookUp", "lookUp"},
                                           {"LookDown", "lookDown"},
                                           {"LookLeft", "lookLeft"},
                                           {"LookRight", "lookRight"}}};

// Of the writer's memory for a frame, beside all bones.
constexpr std::size_t kRoomForShapes = std::size_t{16} * 1024;
constexpr std::size_t kBytesBesideName = 40;  // of a message in a bundle

// A part that has been silent for longer no longer leads.
constexpr std::int64_t kLeads_ns = kNanosPerSecond / 4;

// How far a bone is below the hips [m], the lower one of two sides; nullopt without it.
std::optional<double> below_hips_m(const Skeleton& skeleton, Bone left, Bone right) {
  std::optional<double> below_m;
  for (const Bone bone : {left, right}) {
    int joint = skeleton.joint_of(bone);
    if (joint < 0) continue;
    double height_m = 0.0;
    for (; skeleton.joints[joint].parent >= 0; joint = skeleton.joints[joint].parent) {
      height_m += skeleton.joints[joint].offset_m.y();
    }
    below_m = std::max(below_m.value_or(-height_m), -height_m);
  }
  return below_m;
}

// How high the hips of a figure are [m] that stands in T-pose with its soles on the floor. A
// skeleton ends above the floor: toes and ankles are as high as is usual, in parts of the leg.
std::optional<double> standing_m(const Skeleton& in_t) {
  constexpr double kToes = 0.02, kAnkle = 0.1;
  if (const auto toes_m = below_hips_m(in_t, Bone::kLeftToes, Bone::kRightToes)) {
    return *toes_m * (1.0 + kToes);
  }
  const auto ankle_m = below_hips_m(in_t, Bone::kLeftFoot, Bone::kRightFoot);
  return ankle_m ? std::optional(*ankle_m * (1.0 + kAnkle)) : std::nullopt;
}

// The same of an avatar, whose file says where the floor is: at 0, if its feet are near to that.
std::optional<double> standing_avatar_m(const Skeleton& resting, const Skeleton& in_t) {
  const auto ankle_m = below_hips_m(in_t, Bone::kLeftFoot, Bone::kRightFoot);
  const auto resting_m = below_hips_m(resting, Bone::kLeftFoot, Bone::kRightFoot);
  const auto toes_m = below_hips_m(resting, Bone::kLeftToes, Bone::kRightToes);
  const double hips_m = resting.joints.front().offset_m.y();
  constexpr double kMaxAnkle = 0.35;
  if (!ankle_m || !resting_m || hips_m < toes_m.value_or(*resting_m) ||
      hips_m - *resting_m > kMaxAnkle * *ankle_m) {
    return standing_m(in_t);
  }
  return *ankle_m + (hips_m - *resting_m);
}

// Whether the bones of both, in T-pose, are as long: then a guess of the floor would only move one
// against the other.
bool is_same_figure(const Skeleton& one, const Skeleton& other) {
  constexpr double kOff_m = 1e-3;
  if (one.joints.size() != other.joints.size()) return false;
  for (const Joint& joint : one.joints) {
    const int there = other.joint_of(*joint.bone);
    if (there < 0) return false;
    const Joint& twin = other.joints[static_cast<std::size_t>(there)];
    if (joint.parent >= 0 && (joint.offset_m - twin.offset_m).norm() > kOff_m) return false;
  }
  return true;
}

}  // namespace

// The joints of clips that are no glTF have axes of their own.
Result<std::shared_ptr<const Skeleton>> avatar_figure(const std::filesystem::path& path) {
  const auto clip = TRY(clip::read_clip(path));
  const clip::Format* format = clip::format_of_file(path);
  const bool gltf = format != nullptr && format->read == clip::read_gltf;
  auto figure =
      gltf ? motion::resting_skeleton(*clip.skeleton) : motion::canonical_skeleton(*clip.skeleton);
  if (!figure) return fail("has no humanoid: " + figure.error().message, path.string());
  constexpr double kMinLength_m = 1e-4;
  const bool has_length = std::ranges::any_of((*figure)->joints, [](const Joint& joint) {
    return joint.parent >= 0 && joint.offset_m.norm() > kMinLength_m;
  });
  if (!has_length) return fail("its bones have no length; export it once more", path.string());
  return figure;
}

// The wrist is the body's: a glove's own stream does not say how it is turned.
bool Avatar::writes(Part part, Bone bone) const noexcept {
  if (part == Part::kLeftHand) return is_finger(Side::kLeft, bone);
  if (part == Part::kRightHand) return is_finger(Side::kRight, bone);
  return !hands_only_ || is_of_hand(Side::kLeft, bone) || is_of_hand(Side::kRight, bone);
}

Result<> Avatar::set_skeleton(Part part, const std::shared_ptr<const Skeleton>& skeleton) {
  Source& source = sources_[index_of(part)];
  source = {};
  if (skeleton == nullptr) return {};
  auto canonical = TRY(figure_ == nullptr ? motion::canonical_skeleton(*skeleton, top_of(part))
                                          : motion::resting_skeleton(*figure_, top_of(part)));
  const std::string name = in_quotes(skeleton->name);
  auto bound = TRY(motion::Retarget::bind(skeleton, canonical));
  if (part == Part::kBody && figure_ != nullptr) {
    const auto performer = motion::canonical_skeleton(*skeleton);
    const auto avatar = TRY(motion::canonical_skeleton(*figure_));
    const bool guessed = performer && !is_same_figure(**performer, *avatar);
    const auto from_m = guessed ? standing_m(**performer) : std::nullopt;
    const auto to_m = standing_avatar_m(*figure_, *avatar);
    if (from_m && to_m) source.rise_m = static_cast<float>(*to_m - bound.scale() * *from_m);
  }
  for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
    const Joint& joint = canonical->joints[j];
    const auto bone = sent_bone(*joint.bone);
    if (!bone || !writes(part, *joint.bone)) continue;
    const Eigen::Vector3f offset_m = joint.offset_m.cast<float>();
    source.moved.push_back(
        {.joint = j, .bone = *bone, .offset_m = {offset_m.x(), offset_m.y(), offset_m.z()}});
  }
  if (source.moved.empty()) {
    return fail("skeleton " + name + " has no bones of a " +
                (part == Part::kBody ? "hand" : std::string(words_for(part))));
  }
  source.to_canonical = std::move(bound);
  return {};
}

bool Avatar::set_pose(Part part, const Frame& frame) noexcept {
  Source& source = sources_[index_of(part)];
  if (!source.to_canonical) return false;
  source.to_canonical->apply(frame, source.pose);
  source.posed = true;
  return true;
}

void Avatar::write(vmc::DatagramWriter& writer) const noexcept {
  struct Chosen {
    const Source* source = nullptr;
    const Moved* moved = nullptr;
  };
  std::array<Chosen, vmc::kBoneCount> chosen{};
  for (const Source& source : sources_) {  // a hand after the body, so that it replaces its fingers
    if (!source.posed) continue;
    for (const Moved& moved : source.moved) chosen[moved.bone] = {&source, &moved};
  }
  if (chosen[vmc::kHips].source != nullptr) writer.root({}, kIdentity);
  for (std::size_t bone = 0; bone < vmc::kBoneCount; ++bone) {
    const auto [source, moved] = chosen[bone];
    if (source == nullptr) continue;
    Vec3f hips_m = source->pose.root_position_m;
    hips_m[1] += source->rise_m;
    writer.bone(bone, bone == vmc::kHips ? hips_m : moved->offset_m,
                source->pose.rotation_xyzw[moved->joint]);
  }
}

std::string_view preset_name(std::string_view name, VrmNames wanted) noexcept {
  for (const Preset& preset : kPresets) {
    if (name != preset.vrm0 && name != preset.vrm1) continue;
    return wanted == VrmNames::kVrm0 ? preset.vrm0 : preset.vrm1;
  }
  return name;
}

std::size_t BlendShapes::set_layout(const drivers::SampleLayout& samples) {
  shapes_.clear();
  std::size_t left_out = 0, used = 0;
  for (std::size_t i = 0; i < samples.names.size(); ++i) {
    const std::string& name = samples.names[i];
    if (samples.units[i] != "1" || name.contains('/')) continue;
    used += name.size() + kBytesBesideName;
    if (name.empty() || name.size() > drivers::vmc::kMaxVmcName || used > kRoomForShapes) {
      ++left_out;
      continue;
    }
    shapes_.push_back({.index = i, .name = std::string(preset_name(name, names_))});
  }
  return left_out;
}

void BlendShapes::update(const Sample& sample) noexcept {
  for (Shape& shape : shapes_) {
    if (shape.index >= sample.value_count || !sample.valid[shape.index]) continue;
    shape.value = sample.value[shape.index];
    shape.known = true;
  }
}

void BlendShapes::write(drivers::vmc::DatagramWriter& writer) const noexcept {
  for (const Shape& shape : shapes_) {
    if (shape.known) writer.blend(shape.name, shape.value);
  }
  writer.apply();
}

Result<std::unique_ptr<Output>> VmcOutput::open(const config::OutputConfig& config,
                                                std::unique_ptr<system::EventFd> wake) {
  std::shared_ptr<const Skeleton> figure;
  if (!config.avatar.empty()) figure = TRY(avatar_figure(config.avatar));
  auto receivers = TRY(UdpReceivers::open(config.to));
  return std::make_unique<VmcOutput>(config, std::move(wake), std::move(figure),
                                     std::move(receivers));
}

VmcOutput::VmcOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                     std::shared_ptr<const Skeleton> figure, UdpReceivers receivers)
    : Output(config, std::move(wake)),
      assistant_(config.assistant),
      avatar_(config.assistant, std::move(figure)),
      shapes_(config.vrm1_names ? VrmNames::kVrm1 : VrmNames::kVrm0),
      receivers_(std::move(receivers)),
      writer_(std::make_unique<vmc::DatagramWriter>(vmc::Packing::kBundles)) {
  measured_ns_.fill(kNoTime_ns);
  set_receivers(receivers_.size());
}

Result<> VmcOutput::set_stream(std::size_t place, const LiveStream* stream) {
  const auto part = static_cast<Part>(place);
  measured_ns_[place] = kNoTime_ns;
  if (part == Part::kBody) {
    const std::size_t left_out =
        shapes_.set_layout(stream != nullptr ? stream->samples : drivers::SampleLayout{});
    if (left_out > 0) {
      notify({.text = std::to_string(left_out) + " blend shapes of stream " +
                      in_quotes(stream->name) +
                      " are left out: their names are too long for a frame"});
    }
  }
  const auto set = avatar_.set_skeleton(part, stream != nullptr ? stream->skeleton : nullptr);
  if (!set) {
    return fail("cannot move its " + std::string(words_for(part)) + ": " + set.error().message);
  }
  return {};
}

void VmcOutput::begin_turn(std::int64_t now_ns) {
  if (begin_ns_ == kNoTime_ns) begin_ns_ = now_ns;
  if (sample() && !assistant_) shapes_.update(*sample());
}

std::int64_t VmcOutput::end_turn(std::int64_t now_ns) {
  for (const News& news : receivers_.drain_news(now_ns)) notify(news);
  return system::kForever_ns;
}

bool VmcOutput::leads(Part part, std::int64_t now_ns) const noexcept {
  for (const Part before : kAllParts) {
    if (before == part) return true;
    const std::int64_t measured_ns = measured_ns_[index_of(before)];
    if (measured_ns != kNoTime_ns && now_ns < measured_ns + kLeads_ns) return false;
  }
  return true;
}

// The frame goes into the avatar.
bool VmcOutput::take(std::size_t place, const Frame& frame, std::int64_t now_ns) {
  const auto part = static_cast<Part>(place);
  if (!avatar_.set_pose(part, frame)) return false;
  if (frame.quality != Quality::kStale) measured_ns_[place] = now_ns;
  if (!leads(part, now_ns)) return false;
  quality_ = frame.quality;
  return true;
}

void VmcOutput::send(std::int64_t now_ns) {
  writer_->start();
  avatar_.write(*writer_);
  if (!assistant_) shapes_.write(*writer_);
  if (quality_ == Quality::kStale || quality_ == Quality::kHeld) {
    writer_->status({.tracking = false});
  } else {
    writer_->loaded();
  }
  writer_->time(static_cast<float>(seconds(now_ns - begin_ns_)));
  for (std::size_t i = 0; i < writer_->datagrams(); ++i) datagrams_.add(writer_->datagram(i));
  count(receivers_.send(datagrams_, now_ns));
}

}  // namespace posed::output
