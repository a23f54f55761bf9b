#include "daemon/output/axis_output.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/axis/decoder.hpp"
#include "proto/clip/bvh.hpp"

namespace posed::output {
namespace {

namespace axis = drivers::axis;

constexpr std::uint8_t kOrder = 0;  // YXZ, as the applications are set at first

// The figure of Axis Neuron or Axis Studio whose joints these are; none: of neither.
std::optional<axis::Figure> figure_of(const Skeleton& skeleton) {
  if (skeleton.root_joint < 0 || skeleton.joints.size() != skeleton.root_joint + axis::kBones) {
    return std::nullopt;
  }
  for (const axis::Figure figure : {axis::Figure::kPro, axis::Figure::kStudio}) {
    bool same = true;
    for (std::size_t b = 0; b < axis::kBones && same; ++b) {
      same = skeleton.joints[skeleton.root_joint + b].name == axis::bone_name(b, figure);
    }
    if (same) return figure;
  }
  return std::nullopt;
}

// What the applications would send of a person who is one of their avatars: turns and lengths of
// all bones, also of those that no other figure has. Null: it is none, or has a reference, or rests
// in another way.
std::shared_ptr<const Skeleton> own_avatar(const Skeleton& skeleton, axis::AvatarEntry& entry) {
  constexpr double kSame_rad = 1e-4;
  entry.figure = figure_of(skeleton);
  if (!entry.figure || skeleton.root_joint != 0) return nullptr;
  for (std::size_t b = 1; b < axis::kBones; ++b) {
    const Eigen::Vector3f offset_cm =
        (skeleton.joints[b].offset_m / axis::kCentimetre_m).cast<float>();
    entry.offset_cm[b] = {offset_cm.x(), offset_cm.y(), offset_cm.z()};
  }
  const auto avatar = axis::skeleton_of(entry, kOrder);
  if (!avatar) return nullptr;
  for (std::size_t b = 0; b < axis::kBones; ++b) {
    const Joint& joint = (*avatar)->joints[b];
    if (joint.parent != skeleton.joints[b].parent ||
        joint.T_world_joint.angularDistance(skeleton.joints[b].T_world_joint) > kSame_rad) {
      return nullptr;
    }
  }
  return *avatar;
}

}  // namespace

Result<AxisFigure> AxisFigure::make(const std::shared_ptr<const Skeleton>& skeleton,
                                    std::uint8_t number, std::string_view name) {
  axis::AvatarEntry entry;
  entry.avatar = axis::make_avatar(number, name);
  axis::AvatarEntry own = entry;
  const auto avatar = skeleton != nullptr ? own_avatar(*skeleton, own) : nullptr;
  if (avatar != nullptr) entry = own;
  const axis::Proportions average_cm = entry.offset_cm;
  const auto figure = [&](double scale) {
    for (std::size_t bone = 0; bone < average_cm.size(); ++bone) {
      for (std::size_t k = 0; k < 3; ++k) {
        entry.offset_cm[bone][k] = average_cm[bone][k] * static_cast<float>(scale);
      }
    }
    return axis::skeleton_of(entry, kOrder);
  };
  auto fit = TRY(Fit::make(avatar != nullptr ? avatar : skeleton, avatar != nullptr, figure));
  AxisFigure made(std::move(fit), entry.offset_cm);
  made.message_.avatar = entry.avatar;
  made.message_.content.displacement = true;
  made.known_.resize(axis::value_count(made.message_.content) / 3);
  return made;
}

void AxisFigure::fill(const Frame& frame) noexcept {
  const Frame& pose = fit_.apply(frame);
  message_.frame_number = static_cast<std::uint32_t>(frame.header.sequence);
  const axis::Turned turned = axis::fill_values(fit_.skeleton(), offset_cm_, pose.rotation_xyzw,
                                                pose.root_position_m, last_, message_);
  const std::size_t root = fit_.skeleton().root_joint;
  known_[0].size = 0;  // where the hips are
  for (std::size_t bone = 0; bone < axis::kBones; ++bone) {
    if (!turned[root + bone]) continue;
    known_[axis::rotations_at(message_.content, bone) / 3].size = 0;
  }
}

std::string_view AxisFigure::message(const Frame& frame) noexcept {
  fill(frame);
  const std::size_t size =
      axis::encode_binary(message_, axis::Form::kBinary, std::as_writable_bytes(std::span(text_)));
  return {text_.data(), size};
}

std::string_view AxisFigure::line(const Frame& frame) noexcept {
  fill(frame);
  const std::size_t size =
      axis::encode_text(message_, std::span(text_).first(axis::kMaxText), known_);
  text_[size] = '\n';
  return {text_.data(), size + 1};
}

std::string AxisFigure::hierarchy() const {
  // With displacement every joint has a position.
  Skeleton figure = fit_.skeleton();
  figure.channels.clear();
  const auto joints = static_cast<std::uint16_t>(figure.joints.size());
  for (std::uint16_t joint = 0; joint < joints; ++joint) {
    for (const Axis along : {Axis::kX, Axis::kY, Axis::kZ}) {
      figure.channels.push_back({.joint = joint, .axis = along, .translation = true});
    }
    for (const Channel& channel : fit_.skeleton().channels) {
      if (channel.joint == joint && !channel.translation) figure.channels.push_back(channel);
    }
  }
  return clip::bvh_hierarchy(figure, axis::kCentimetre_m);
}

Result<std::unique_ptr<Output>> AxisOutput::open(const config::OutputConfig& config,
                                                 std::unique_ptr<system::EventFd> wake) {
  if (!config.to.empty()) {
    auto receivers = TRY(UdpReceivers::open(config.to));
    return std::make_unique<AxisOutput>(config, std::move(wake), std::nullopt,
                                        std::move(receivers));
  }
  auto clients = TRY(LineClients::open(config.listen, config.peers, config.people()));
  return std::make_unique<AxisOutput>(config, std::move(wake), std::move(clients), std::nullopt);
}

AxisOutput::AxisOutput(const config::OutputConfig& config, std::unique_ptr<system::EventFd> wake,
                       std::optional<LineClients> clients, std::optional<UdpReceivers> receivers)
    : Output(config, std::move(wake)),
      header_(config.header),
      binary_(config.binary),
      clients_(std::move(clients)),
      receivers_(std::move(receivers)),
      people_(config.people()),
      names_(config.people()) {}

Result<> AxisOutput::set_stream(std::size_t place, const LiveStream* stream) {
  Person& person = people_[place];
  person.figure.reset();
  person.waits = false;
  names_[place].clear();
  if (stream == nullptr) return {};
  // A blank ends the name in a line of text.
  const auto& skeleton = stream->skeleton;
  const bool keeps_name = skeleton != nullptr && figure_of(*skeleton) &&
                          (binary_ || skeleton->name.find(' ') == std::string::npos);
  const std::string name =
      distinct_name(keeps_name ? skeleton->name : stream->name, stream->name, place, names_);
  auto figure = AxisFigure::make(skeleton, static_cast<std::uint8_t>(place), name);
  if (!figure) return fail("cannot be sent: " + figure.error().message);
  person.figure = std::make_unique<AxisFigure>(std::move(*figure));
  if (header_) clients_->set_greeting(person.figure->hierarchy());
  return {};
}

void AxisOutput::begin_turn(std::int64_t now_ns) {
  if (look_ns_ != kNoTime_ns && now_ns < look_ns_) return;
  for (const News& news : clients_ ? clients_->look(now_ns) : receivers_->drain_news(now_ns)) {
    notify(news);
  }
  look_ns_ = now_ns + LineClients::kLook_ns;
}

bool AxisOutput::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  Person& person = people_[place];
  if (person.figure == nullptr) return false;
  person.frame = frame;
  person.waits = true;
  return true;
}

void AxisOutput::send(std::int64_t now_ns) {
  for (Person& person : people_) {
    if (!std::exchange(person.waits, false) || (clients_ && clients_->size() == 0)) continue;
    AxisFigure& figure = *person.figure;
    const std::string_view message =
        binary_ ? figure.message(person.frame) : figure.line(person.frame);
    if (clients_) {
      count(clients_->send(message, now_ns));
    } else {
      datagrams_.add(std::as_bytes(std::span(message)));
    }
  }
}

std::int64_t AxisOutput::end_turn(std::int64_t now_ns) {
  if (receivers_) count(receivers_->send(datagrams_, now_ns));
  set_receivers(clients_ ? clients_->size() : receivers_->size());
  return look_ns_;
}

}  // namespace posed::output
