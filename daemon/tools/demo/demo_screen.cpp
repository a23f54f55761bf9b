#include "daemon/tools/demo/demo_screen.hpp"

#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>  // program_invocation_name
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/assembly/daemon.hpp"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

constexpr std::array kLabels{"g", "1", "c", "3", "4", "p"};
// a performance takes about 12 s; the rest shows the live hand
constexpr double kAgainAfter_s = 25.0;
constexpr double kStyled_s = 12.0, kPlain_s = 6.0;

bool is_performed(const v1::Frame& frame) {
  return frame.source() == v1::SOURCE_LABELS && !frame.label().empty();
}

}  // namespace

Result<DemoRequests> DemoRequests::open(const std::string& control) {
  ClientOptions client;
  client.endpoint = control;
  auto connection = TRY(Connection::open(client, ZMQ_DEALER));
  return DemoRequests(std::move(connection));
}

Result<> DemoRequests::send(const v1::ControlRequest& request) {
  if (connection_.send(request.SerializeAsString())) return {};
  return fail("the demo's own request cannot be sent");
}

Result<> DemoRequests::read_reply(std::string_view what) {
  net::Message message;
  if (!connection_.receive(message)) return {};
  v1::ControlReply reply;
  if (message::parse_bounded(reply, message.bytes()) && reply.ok()) return {};
  return fail(fmt::format("the demo's own {} was refused: {}", what, reply.error()));
}

Result<DemoStyle> DemoStyle::open(const std::string& control) {
  auto requests = TRY(DemoRequests::open(control));
  return DemoStyle(std::move(requests));
}

Result<> DemoStyle::tend(double seconds, const std::function<v1::Stats()>& stats) {
  TRY(requests_.read_reply("change of alpha"));
  if (left_alone_ || seconds < next_s_) return {};
  const v1::Stats now = stats();
  const auto walker = std::ranges::find(now.stream(), kDemoWalkerStream, &v1::StreamStats::stream);
  if (walker == now.stream().end() || walker->alpha_target() != asked_) {
    left_alone_ = true;
    return {};
  }
  asked_ = 1.0F - asked_;
  next_s_ = seconds + (asked_ > 0.0F ? kStyled_s : kPlain_s);
  v1::ControlRequest request;
  auto& set = *request.mutable_set_parameter();
  set.set_stream(kDemoWalkerStream);
  set.set_name("alpha");
  set.set_number(asked_);
  return requests_.send(request);
}

std::string DemoStyle::note() const {
  if (left_alone_) return "walker: alpha stays as you set it";
  return asked_ > 0.0F ? "walker: sneaks; in a moment the style goes off, and comes again"
                       : "walker: as he was captured; in a moment the style comes again";
}

Result<DemoHand> DemoHand::open(const std::string& control) {
  auto requests = TRY(DemoRequests::open(control));
  return DemoHand(std::move(requests));
}

void DemoHand::handle(const v1::Frame& frame) {
  ++frames_;
  if (is_performed(frame)) {
    if (!is_performed(last_)) performed_.clear();
    if (performed_.empty() || performed_.back() != frame.label()) {
      performed_.push_back(frame.label());
    }
    ++performed_frames_;
  }
  last_ = frame;
}

Result<> DemoHand::tend(double seconds) {
  if (frames_ > 0 && seconds >= next_play_s_) {
    next_play_s_ += kAgainAfter_s;
    v1::ControlRequest request;
    auto& wanted = *request.mutable_stage_command();
    wanted.set_stream(kDemoHandStream);
    wanted.set_name("play");
    for (const char* label : kLabels) wanted.add_word(label);
    TRY(requests_.send(request));
  }
  return requests_.read_reply("play command");
}

std::string DemoHand::note() const {
  if (frames_ == 0) return "hand: waiting";
  if (last_.source() == v1::SOURCE_LABELS) {
    return fmt::format("hand: plays {} (1, 3 and 4 are not in its training data): {}",
                       joined(kLabels, " "), clean_name(last_.label()));
  }
  const std::string label = last_.label().empty()
                                ? "no gesture that it knows"
                                : fmt::format("{} ({:.0f} %)", clean_name(last_.label()),
                                              100.0F * last_.label_probability());
  return fmt::format("hand: a live signer's, smoothed {} frame behind: {}", last_.lag_frames(),
                     label);
}

std::string DemoHand::summary() const {
  if (frames_ == 0) return {};
  return fmt::format("received {} hand frames, {} of them played from labels: {}", frames_,
                     performed_frames_, performed_.empty() ? "none" : joined(performed_, " "));
}

namespace {

using namespace std::chrono_literals;

// The figure moves often; numbers that change often cannot be read.
constexpr auto kDrawEvery = 100ms, kLookEvery = 500ms, kPlainLinesEvery = 5000ms;
constexpr auto kStatsEvery = 1000ms;  // a bar of the latency

// How this program was called, for the commands that it suggests.
std::string own_name() {
  const std::string name = program_invocation_name;
  return name.contains('/') ? name : "posed";
}

// Whether that time has passed since the last time; the first time it has.
bool is_due(std::optional<std::chrono::steady_clock::time_point>& last,
            std::chrono::milliseconds every) {
  const auto now = std::chrono::steady_clock::now();
  if (last && now - *last < every) return false;
  last = now;
  return true;
}

}  // namespace

DemoScreen::DemoScreen(const assembly::Daemon& daemon, Connection& connection,
                       const std::string& url)
    : daemon_(daemon),
      first_line_(url.empty() ? "" : "see it: " + url),
      chosen_(connection, {.endpoint = daemon.control_endpoint(), .key = {}, .server_key = {}}),
      view_{.title = "posed demo " + daemon.publish_endpoint()} {
  if (!screen_.is_terminal()) return;
  view_.panel = [this](int rows) { return chosen_.lines(stats_, view_.width, rows); };
}

bool DemoScreen::quits() {
  for (Key key = screen_.next_key(); key != Key::kNone; key = screen_.next_key()) {
    if (key == Key::kQuit) return true;
    answer_.reset();
    chosen_.obey(key, stats_);
  }
  if (auto note = chosen_.note()) answer_ = std::move(note);
  return false;
}

// Renews the numbers.
void DemoScreen::look(Watcher& watcher, const DemoStyle& style, const DemoHand& hand) {
  const bool first = stats_.time_ns() == 0;
  stats_ = daemon_.stats();
  if (screen_.is_terminal() && is_due(taken_, kStatsEvery)) chosen_.update(stats_);
  view_.notes.clear();
  if (screen_.is_terminal() || first) {
    view_.notes.push_back(fmt::format(
        "in another terminal: {0} monitor, or: {0} ctl play hand \"p 4 3 1 g\"", own_name()));
  }
  if (!screen_.is_terminal() && first) view_.notes.push_back("Ctrl-C ends the demo");
  view_.notes.push_back(
      fmt::format("received {} styled frames, {} missing; {:.1f} deg rms from the raw pose",
                  watcher.styled(), watcher.gaps(), watcher.change_lately_deg()));
  view_.notes.push_back(style.note());
  view_.notes.push_back(hand.note());
  if (answer_) view_.notes.push_back(*answer_);
}

void DemoScreen::show(Watcher& watcher, const DemoStyle& style, const DemoHand& hand) {
  if (!is_due(drawn_, screen_.is_terminal() ? kDrawEvery : kPlainLinesEvery)) return;
  if (!screen_.is_terminal() || is_due(looked_, kLookEvery)) look(watcher, style, hand);
  screen_.measure(view_);
  view_.chosen = screen_.is_terminal() ? chosen_.name() : "";
  // Elsewhere than on a terminal the address was printed once, before the first of many views.
  const bool headed = screen_.is_terminal() && !first_line_.empty();
  // A terminal that is too narrow for it shows the address on two lines.
  const int columns = static_cast<int>(first_line_.size());
  if (headed) view_.height -= (columns + view_.width - 1) / std::max(view_.width, 1);
  std::vector<std::string> lines = live_view(stats_, view_);
  if (headed) lines.insert(lines.begin(), first_line_);
  screen_.draw(lines);
}

}  // namespace posed::tools
