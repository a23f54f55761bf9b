#include "daemon/output/axis_figure.hpp"

#include <utility>

#include "drivers/axis/decoder.hpp"
#include "proto/clip/bvh.hpp"

namespace posed::output {
namespace {

namespace axis = drivers::axis;

constexpr std::uint8_t kOrder = 0;  // YXZ, as the applications are set at first

}  // namespace

Result<AxisFigure> AxisFigure::make(std::shared_ptr<const Skeleton> skeleton, std::uint8_t number,
                                    std::string_view name) {
  axis::AvatarEntry entry;
  entry.avatar = axis::make_avatar(number, name);
  const axis::Proportions average_cm = entry.offset_cm;
  const auto figure = [&](double scale) {
    for (std::size_t bone = 0; bone < average_cm.size(); ++bone) {
      for (std::size_t k = 0; k < 3; ++k) {
        entry.offset_cm[bone][k] = average_cm[bone][k] * static_cast<float>(scale);
      }
    }
    return axis::skeleton_of(entry, kOrder);
  };
  auto fit = TRY(Fit::make(std::move(skeleton), /*own=*/false, figure));
  AxisFigure made(std::move(fit), entry.offset_cm);
  made.message_.avatar = entry.avatar;
  made.message_.content.displacement = true;
  return made;
}

void AxisFigure::fill(const Frame& frame) noexcept {
  const Frame& pose = fit_.apply(frame);
  message_.frame_number = static_cast<std::uint32_t>(frame.header.sequence);
  axis::fill_values(fit_.skeleton(), offset_cm_, pose.rotation_xyzw, pose.root_position_m,
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

}  // namespace posed::output
