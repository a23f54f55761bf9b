#include "daemon/tools/live/chosen_stream.hpp"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/picture/braille.hpp"
#include "models/motion/motion.hpp"
#include "models/style/live/style_filter.hpp"
#include "posed/v1/control.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/message/bounded_parse.hpp"
#include "proto/message/skeleton_message.hpp"
#include "proto/text/clean.hpp"

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
    frame.root_position_m[i] = message.root_position_m(i);
  }
  return frame;
}

}  // namespace

void StreamFigure::handle(std::string_view topic, std::span<const std::byte> body) {
  if (topic == "skeleton/" + stream_) take_skeleton(body);
  if (topic == "pose/" + stream_) take_pose(body);
}

void StreamFigure::take_skeleton(std::span<const std::byte> body) {
  v1::Skeleton message;
  if (!message::parse_bounded(message, body)) return;
  if (shape_ != nullptr && message.id() == wire_id_) return;
  auto skeleton = message::skeleton_from(message);
  if (!skeleton) return;
  wire_id_ = message.id();
  skeleton_ = std::move(*skeleton);
  shape_ = std::make_unique<picture::FigureShape>(skeleton_);
  camera_.reset();
  pose_.reset();
  figure_.reset();
  room_.reset();
}

void StreamFigure::take_pose(std::span<const std::byte> body) {
  v1::Frame message;
  if (shape_ == nullptr || !message::parse_bounded(message, body) ||
      message.skeleton_id() != wire_id_) {
    return;
  }
  auto pose = frame_from(message, *skeleton_);
  if (!pose) return;
  pose_ = std::move(pose);
  if (!camera_) {
    const motion::Motion still{.skeleton = skeleton_, .rate_hz = 1.0, .frames = {*pose_}};
    camera_.emplace(picture::View::kThreeQuarter, shape_->facing(motion::walk_heading_rad(still)));
  }
  figure_ = shape_->pose(*pose_);
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

namespace {

constexpr std::size_t kSecondsKept = 60;
constexpr int kFigureColumns = 36, kMinRows = 6, kMaxShownRows = 16;
constexpr double kAlphaStep = 0.1;
constexpr std::chrono::seconds kAnswerWithin{3};  // with an answer

}  // namespace

const v1::StreamStats* ChosenStream::stats_of(const v1::Stats& stats) const {
  for (const v1::StreamStats& stream : stats.stream()) {
    if (figure_ && stream.stream() == figure_->stream()) return &stream;
  }
  return nullptr;
}

void ChosenStream::subscribe(const std::string& stream, bool wanted) {
  for (const char* kind : {"skeleton/", "pose/"}) {
    static_cast<void>(data_.subscribe(kind + stream, wanted));
  }
}

void ChosenStream::unfollow() {
  if (figure_) subscribe(figure_->stream(), false);
  figure_.reset();
  asked_alpha_.reset();
}

void ChosenStream::follow(const std::string& stream) {
  unfollow();
  subscribe(stream, true);
  figure_.emplace(stream);
}

void ChosenStream::update(const v1::Stats& stats) {
  for (const v1::StreamStats& stream : stats.stream()) {
    auto& history = latency_us_[stream.stream()];
    history.push_back(stream.publish().p99_us());
    if (history.size() > kSecondsKept) history.pop_front();
  }
  std::erase_if(latency_us_, [&](const auto& kept) {
    return std::ranges::none_of(stats.stream(), [&](const v1::StreamStats& stream) {
      return stream.stream() == kept.first;
    });
  });
  const v1::StreamStats* chosen = stats_of(stats);
  if (chosen == nullptr && stats.stream_size() > 0) follow(stats.stream(0).stream());
  if (chosen == nullptr && stats.stream_size() == 0) unfollow();
  asked_alpha_.reset();
}

void ChosenStream::handle(std::string_view topic, std::span<const std::byte> body) {
  if (figure_) figure_->handle(topic, body);
}

void ChosenStream::obey(Key key, const v1::Stats& stats) {
  if (key == Key::kUp) choose(stats, -1);
  if (key == Key::kDown) choose(stats, 1);
  if (key == Key::kLeft) change_alpha(stats, -kAlphaStep);
  if (key == Key::kRight) change_alpha(stats, kAlphaStep);
}

void ChosenStream::choose(const v1::Stats& stats, int step) {
  const int streams = stats.stream_size();
  if (streams < 2) return;
  for (int i = 0; i < streams; ++i) {
    if (!figure_ || stats.stream(i).stream() != figure_->stream()) continue;
    follow(stats.stream((i + step + streams) % streams).stream());
    return;
  }
}

void ChosenStream::change_alpha(const v1::Stats& stats, double by) {
  const v1::StreamStats* chosen = stats_of(stats);
  if (chosen == nullptr) return;
  if (!has_alpha(*chosen)) {
    note_ = clean_name(chosen->stream()) + " has no style stage, so it has no alpha";
    return;
  }
  if (!stats.replay_file().empty()) {
    note_ = "this is a replay, which nobody can control";
    return;
  }
  if (control_options_.endpoint.empty()) {
    note_ = "add --control, with the daemon's control endpoint, to change alpha from here";
    return;
  }
  if (!control_) {
    auto opened = Connection::open(control_options_, ZMQ_DEALER);
    if (!opened) {
      note_ = opened.error().text();
      return;
    }
    control_.emplace(std::move(*opened));
  }
  const double now = asked_alpha_.value_or(chosen->alpha_target());
  ask(chosen->stream(),
      std::clamp(std::round((now + by) * 10.0) / 10.0, -style::kMaxAlpha, style::kMaxAlpha));
}

void ChosenStream::ask(const std::string& stream, double alpha) {
  v1::ControlRequest request;
  auto& set = *request.mutable_set_parameter();
  set.set_stream(stream);
  set.set_name("alpha");
  set.set_number(alpha);
  if (control_->send(request.SerializeAsString())) {
    asked_alpha_ = alpha;
    if (!asked_at_) asked_at_ = std::chrono::steady_clock::now();
  } else {
    note_ = "the request for another alpha cannot be sent to " + control_options_.endpoint;
  }
}

// A connection without an answer is closed, so that no old request takes effect when the daemon is
// back.
void ChosenStream::read_answer() {
  net::Message message;
  if (control_->receive(message)) {
    asked_at_.reset();
    v1::ControlReply reply;
    const bool valid = message::parse_bounded(reply, message.bytes());
    if (!valid || !reply.ok()) {
      const std::string why = valid ? clean(reply.error()) : "the answer cannot be read";
      note_ = "alpha stays: " + (why.empty() ? "the daemon does not say why" : why);
      asked_alpha_.reset();
    }
    return;
  }
  std::optional<Error> failed = control_->refusal();
  const bool late = asked_at_ && std::chrono::steady_clock::now() - *asked_at_ > kAnswerWithin;
  if (!failed && late) failed = control_->no_answer();
  if (!failed) return;
  note_ = "alpha stays: " + failed->text();
  control_.reset();
  asked_at_.reset();
  asked_alpha_.reset();
}

std::optional<std::string> ChosenStream::note() {
  if (control_ && !note_) read_answer();
  return std::exchange(note_, std::nullopt);
}

std::string ChosenStream::latency_line(const std::string& stream, int columns) const {
  const auto found = latency_us_.find(stream);
  if (found == latency_us_.end()) return {};
  const auto& kept = found->second;
  const double most_us = kept.empty() ? 0.0 : *std::ranges::max_element(kept);
  if (!(most_us > 0.0)) return {};
  const std::string words = fmt::format("{}: latency 99 %, at most {} ", clean_name(stream),
                                        display_duration(most_us * 1e-6));
  const int room = columns - static_cast<int>(words.size());
  const auto count = std::min(kept.size(), static_cast<std::size_t>(std::max(room, 0)));
  const auto first = kept.end() - static_cast<std::ptrdiff_t>(count);
  return cut(words, columns) + sparkline({first, kept.end()});
}

std::vector<std::string> ChosenStream::lines(const v1::Stats& stats, int columns, int rows) {
  const v1::StreamStats* chosen = stats_of(stats);
  if (chosen == nullptr || rows < 1) return {};
  std::vector<std::string> out;
  if (std::string line = latency_line(chosen->stream(), columns); !line.empty()) {
    out.push_back(std::move(line));
  }
  std::string keys = stats.stream_size() > 1 ? "up/down: stream   " : "";
  const bool controls = !control_options_.endpoint.empty() && stats.replay_file().empty();
  if (has_alpha(*chosen) && controls) keys += "left/right: alpha   ";
  const int figure_rows = std::min(rows - static_cast<int>(out.size()) - 1, kMaxShownRows);
  if (figure_rows >= kMinRows) {
    for (std::string& row : figure_->lines(std::min(columns, kFigureColumns), figure_rows)) {
      out.push_back(std::move(row));
    }
  }
  if (static_cast<int>(out.size()) < rows) out.push_back(cut(keys + "q: end", columns));
  return out;
}

}  // namespace posed::tools
