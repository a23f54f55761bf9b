#include "daemon/tools/live/stream_figure.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "daemon/tools/picture/braille.hpp"
#include "models/motion/motion.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/skeleton_message.hpp"

namespace posed::tools {
namespace {

// How far the room goes towards that of the present pose when it is drawn: at ten drawings a second
// a pose that was unusually large is forgotten after some ten seconds.
constexpr double kShrink = 0.02;

// The pose in a message of `skeleton`'s stream; empty if its counts do not fit.
std::optional<Frame> frame_from(const v1::Frame& message, const Skeleton& skeleton) {
  const std::size_t joints = skeleton.joints.size();
  if (message.rotation_xyzw_size() != static_cast<int>(4 * joints) ||
      message.validity().size() != joints || message.root_position_m_size() != 3) {
    return std::nullopt;
  }
  Frame frame;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    Quatf rotation{};
    float square = 0.0F;
    for (std::size_t i = 0; i < 4; ++i) {
      rotation[i] = message.rotation_xyzw(static_cast<int>(4 * j + i));
      square += rotation[i] * rotation[i];
    }
    // What is no rotation (false for NaN, too) counts as not rotated.
    frame.valid[j] = std::abs(square - 1.0F) < 0.1F;
    frame.rotation_xyzw[j] = frame.valid[j] ? rotation : kIdentity;
  }
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(message.root_position_m(i))) return std::nullopt;
    frame.root_position_m[static_cast<std::size_t>(i)] = message.root_position_m(i);
  }
  return frame;
}

}  // namespace

void StreamFigure::take(std::string_view topic, std::span<const std::byte> body) {
  if (topic == "skeleton/" + stream_) take_skeleton(body);
  if (topic == "pose/" + stream_) take_pose(body);
}

void StreamFigure::take_skeleton(std::span<const std::byte> body) {
  v1::Skeleton message;
  if (!message.ParseFromArray(body.data(), static_cast<int>(body.size()))) return;
  if (shape_ != nullptr && message.id() == wire_id_) return;
  auto skeleton = message::skeleton_from(message);
  if (!skeleton) return;
  wire_id_ = message.id();
  skeleton_ = std::move(*skeleton);
  shape_ = std::make_unique<picture::FigureShape>(skeleton_);
  camera_.reset();
  figure_.reset();
  room_.reset();
}

void StreamFigure::take_pose(std::span<const std::byte> body) {
  v1::Frame message;
  if (shape_ == nullptr || !message.ParseFromArray(body.data(), static_cast<int>(body.size())) ||
      message.skeleton_id() != wire_id_) {
    return;
  }
  const auto frame = frame_from(message, *skeleton_);
  if (!frame) return;
  if (!camera_) {
    const motion::Motion still{.skeleton = skeleton_, .rate_hz = 1.0, .frames = {*frame}};
    camera_.emplace(picture::View::kThreeQuarter, shape_->facing(motion::walk_heading_rad(still)));
  }
  figure_ = shape_->pose(*frame);
}

void StreamFigure::fit_room() {
  picture::StripRow row;
  row.poses.push_back({.figure = *figure_, .caption = {}});
  const picture::StripLayout now = picture::layout_of({row}, *camera_, 1.0, false);
  if (!room_) room_ = now;
  const auto lower = [](double& kept, double value) {
    kept = std::min(value, std::lerp(kept, value, kShrink));
  };
  const auto raise = [](double& kept, double value) {
    kept = std::max(value, std::lerp(kept, value, kShrink));
  };
  lower(room_->left_m, now.left_m);
  lower(room_->bottom_m, now.bottom_m);
  raise(room_->right_m, now.right_m);
  raise(room_->top_m, now.top_m);
}

std::vector<std::string> StreamFigure::lines(int columns, int rows) {
  if (!figure_ || columns < 1 || rows < 1) return {};
  fit_room();
  return picture::braille(*figure_, *camera_, *room_, columns, rows);
}

}  // namespace posed::tools
