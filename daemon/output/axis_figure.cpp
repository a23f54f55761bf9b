#include "daemon/output/axis_figure.hpp"

#include <utility>

#include "drivers/axis/decoder.hpp"
#include "proto/clip/bvh.hpp"

namespace posed::output {
namespace {

namespace axis = drivers::axis;

constexpr std::uint8_t kOrder = 0;  // YXZ, as the applications are set at first

}  // namespace

Result<AxisFigure> AxisFigure::make(std::shared_ptr<const Skeleton> skeleton,
                                    std::string_view name) {
  axis::AvatarEntry entry;
  entry.avatar = axis::make_avatar(0, name);
  const auto average = TRY(axis::skeleton_of(entry, kOrder));
  const auto to_average = TRY(motion::Retarget::bind(skeleton, average));
  const auto scale = static_cast<float>(1.0 / to_average.scale());
  for (Vec3f& offset_cm : entry.offset_cm) {
    for (float& x_cm : offset_cm) x_cm *= scale;
  }
  auto figure = TRY(axis::skeleton_of(entry, kOrder));
  auto to_figure = TRY(motion::Retarget::bind(std::move(skeleton), std::move(figure)));
  AxisFigure made(std::move(to_figure), entry.offset_cm);
  made.message_.avatar = entry.avatar;
  made.message_.content.displacement = true;
  return made;
}

void AxisFigure::fill(const Frame& frame) noexcept {
  to_figure_.apply(frame, pose_);
  message_.frame_number = static_cast<std::uint32_t>(frame.header.sequence);
  axis::fill_values(*to_figure_.target(), offset_cm_, pose_.rotation_xyzw, pose_.root_position_m,
                    near_rad_, message_);
}

std::string_view AxisFigure::message(const Frame& frame) noexcept {
  fill(frame);
  const std::size_t size =
      axis::encode_binary(message_, axis::Form::kBinary, std::as_writable_bytes(std::span(text_)));
  return {text_.data(), size};
}

std::string_view AxisFigure::line(const Frame& frame) noexcept {
  fill(frame);
  const std::size_t size = axis::encode_text(message_, std::span(text_).first(axis::kMaxText));
  text_[size] = '\n';
  return {text_.data(), size + 1};
}

std::string AxisFigure::hierarchy() const {
  // With displacement every joint has a position.
  Skeleton figure = *to_figure_.target();
  figure.channels.clear();
  const auto joints = static_cast<std::uint16_t>(figure.joints.size());
  for (std::uint16_t joint = 0; joint < joints; ++joint) {
    for (const Axis along : {Axis::kX, Axis::kY, Axis::kZ}) {
      figure.channels.push_back({.joint = joint, .axis = along, .translation = true});
    }
    for (const Channel& channel : to_figure_.target()->channels) {
      if (channel.joint == joint && !channel.translation) figure.channels.push_back(channel);
    }
  }
  return clip::bvh_hierarchy(figure, axis::kCentimetre_m);
}

}  // namespace posed::output
