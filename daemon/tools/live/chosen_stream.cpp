#include "daemon/tools/live/chosen_stream.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/live/live_table.hpp"
#include "daemon/tools/live/sparkline.hpp"
#include "models/style/live/style_filter.hpp"
#include "posed/v1/control.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr std::size_t kSecondsKept = 60;
constexpr int kFigureColumns = 36, kFewestRows = 6, kMostRows = 16;
constexpr double kAlphaStep = 0.1;
constexpr std::chrono::seconds kAnswerWithin{3};  // with an answer

}  // namespace

const v1::StreamStats* ChosenStream::stats_of(const v1::Stats& stats) const {
  for (const v1::StreamStats& stream : stats.stream()) {
    if (figure_ && stream.stream() == figure_->stream()) return &stream;
  }
  return nullptr;
}

void ChosenStream::subscribe(int option, const std::string& stream) const {
  for (const char* kind : {"skeleton/", "pose/"}) {
    static_cast<void>(net::set_option(data_.socket(), option, kind + stream));
  }
}

void ChosenStream::unfollow() {
  if (figure_) subscribe(ZMQ_UNSUBSCRIBE, figure_->stream());
  figure_.reset();
  asked_alpha_.reset();
}

void ChosenStream::follow(const std::string& stream) {
  unfollow();
  subscribe(ZMQ_SUBSCRIBE, stream);
  figure_.emplace(stream);
}

void ChosenStream::take(const v1::Stats& stats) {
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

void ChosenStream::take(std::string_view topic, std::span<const std::byte> body) {
  if (figure_) figure_->take(topic, body);
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
  if (net::send_part(control_->socket(), request.SerializeAsString(), false)) {
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
  if (message.receive(control_->socket())) {
    asked_at_.reset();
    v1::ControlReply reply;
    const auto bytes = message.bytes();
    const bool sound = reply.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
    if (!sound || !reply.ok()) {
      note_ = "alpha stays: " + (sound ? clean(reply.error()) : "the answer cannot be read");
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
  const std::string words =
      fmt::format("{}: latency 99 %, at most {} ", clean_name(stream), people_duration(most_us));
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
  const int figure_rows = std::min(rows - static_cast<int>(out.size()) - 1, kMostRows);
  if (figure_rows >= kFewestRows) {
    for (std::string& row : figure_->lines(std::min(columns, kFigureColumns), figure_rows)) {
      out.push_back(std::move(row));
    }
  }
  if (static_cast<int>(out.size()) < rows) out.push_back(cut(keys + "q: end", columns));
  return out;
}

}  // namespace posed::tools
