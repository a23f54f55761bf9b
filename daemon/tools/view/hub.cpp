#include "daemon/tools/view/hub.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "drivers/landmarks/protocol.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/json_text.hpp"

namespace posed::view {
namespace {

using nlohmann::json;

Parcel word(const json& value) {
  return {.bytes = std::make_shared<const std::string>(json_text(value)), .text = true};
}

// A page shows and changes streams; the daemon belongs to whoever started it.
std::string refusal_of(const v1::ControlRequest& request) {
  switch (request.request_case()) {
    case v1::ControlRequest::kStatus:
    case v1::ControlRequest::kSetParameter:
    case v1::ControlRequest::kStageCommand:
    case v1::ControlRequest::kModelPart:
    case v1::ControlRequest::kCalibrate:
    case v1::ControlRequest::kTake:
    case v1::ControlRequest::kListModels:
    case v1::ControlRequest::kUseModel:
    case v1::ControlRequest::kTeach:
    case v1::ControlRequest::kFitGlove:
    case v1::ControlRequest::kListRecordings:
    case v1::ControlRequest::kFetchRecording:
    case v1::ControlRequest::kRenameModel:
    case v1::ControlRequest::kDeleteModel:
      return {};
    case v1::ControlRequest::kStop:
      return "a page may not end the daemon: use `posed ctl stop`";
    default:
      return "a page may not ask for this: use `posed ctl`";
  }
}

}  // namespace

namespace {

// A page that is closed or has stopped its camera says nothing more.
constexpr std::string_view kCameraEnds =
    R"({"posed":"landmarks","version":1,"end":true,"hands":[]})";
constexpr std::int64_t kCameraSilent_ns = 2 * kNanosPerSecond;

// The identity of the first source for hands of any tracker.
std::string hands_source_of(std::string_view stats) {
  v1::Stats message;
  if (!message::parse_bounded(message, std::as_bytes(std::span(stats)))) return {};
  const auto found = std::ranges::find(message.source(), "landmarks", &v1::SourceStats::driver);
  return found == message.source().end() ? std::string() : found->identity();
}

// Empty for what is no sound message of a hand tracker that tells the time.
std::string checked_landmarks(std::string_view text) {
  namespace landmarks = drivers::landmarks;
  constexpr double kMaxTime_s = 9e9;
  landmarks::Message message;
  if (text.size() > kMaxLandmarksWord) return {};
  const bool sound = landmarks::read_message(text, message) == Outcome::kOk &&
                     std::abs(message.time_s) <= kMaxTime_s;  // false for NaN
  const auto all = std::span(message.hands).first(message.count);
  const bool hands =
      std::ranges::all_of(all, [](const auto& hand) { return hand.outcome == Outcome::kOk; });
  return sound && hands ? landmarks::write_message(message) : std::string();
}

}  // namespace

PageWord read_word(std::string_view text) {
  if (text.starts_with(R"({"posed":"landmarks")")) {
    return LandmarksWord{.json = checked_landmarks(text)};
  }
  if (text.size() > kMaxWord) return UnknownWord{};
  const json value = json::parse(text, nullptr, false);
  if (!value.is_object()) return UnknownWord{};
  const auto type = value.find("type");
  if (type == value.end()) return UnknownWord{};
  if (*type == "ready") return ReadyWord{};
  const auto t0 = value.find("t0");
  if (*type == "clock" && t0 != value.end() && t0->is_number()) {
    return ClockWord{.t0 = t0->get<double>()};
  }
  return UnknownWord{};
}

Result<PageRequest> read_request(std::string_view bytes) {
  constexpr std::size_t kNumberBytes = 4;
  if (bytes.size() < kNumberBytes) return fail("a request begins with its number, 4 bytes");
  PageRequest asked;
  for (std::size_t i = 0; i < kNumberBytes; ++i) {
    asked.number |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  }
  bytes.remove_prefix(kNumberBytes);
  const auto size = static_cast<int>(std::min(bytes.size(), kMaxPageMessage));
  if (!asked.request.ParseFromArray(bytes.data(), size)) {
    asked.refusal = "this is not a posed.v1.ControlRequest";
    return asked;
  }
  // Only what was checked may pass: a newer daemon may know fields that this program does not.
  asked.request.DiscardUnknownFields();
  asked.refusal = refusal_of(asked.request);
  return asked;
}

Bytes with_topic(std::string_view topic, std::string_view body) {
  constexpr std::size_t kMaxTopicBytes = 255;
  topic = topic.substr(0, kMaxTopicBytes);
  std::string bytes;
  bytes.reserve(1 + topic.size() + body.size());
  bytes += static_cast<char>(topic.size());
  bytes += topic;
  bytes += body;
  return std::make_shared<const std::string>(std::move(bytes));
}

std::string reply_topic(std::uint32_t number) { return "reply/" + std::to_string(number); }

Parcel refusal_reply(std::uint32_t number, const std::string& sentence) {
  v1::ControlReply reply;
  reply.set_error(sentence);
  return {.bytes = with_topic(reply_topic(number), reply.SerializeAsString())};
}

Parcel hello_word(const Greeting& greeting, const ControlRight& right) {
  return word({{"type", "hello"},
               {"version", greeting.version},
               {"connect", greeting.connect},
               {"same_machine", greeting.same_machine},
               {"camera", greeting.camera},
               {"may_control", right.may},
               {"read_only_reason", right.reason}});
}

Parcel control_word(const ControlRight& right) {
  return word(
      {{"type", "control"}, {"may_control", right.may}, {"read_only_reason", right.reason}});
}

Parcel daemon_word(const DaemonState& state) {
  return word({{"type", "daemon"}, {"alive", state.alive}, {"sentence", state.sentence}});
}

Parcel clock_word(double t0, std::int64_t monotonic_ns) {
  return word({{"type", "clock"}, {"t0", t0}, {"monotonic_ns", std::to_string(monotonic_ns)}});
}

Parcel landmarks_word(const std::string& refusal) {
  return word({{"type", "landmarks"}, {"refusal", refusal}});
}

Parcel no_reply_word(std::uint32_t number, const std::string& sentence) {
  return word({{"type", "no_reply"}, {"request", number}, {"error", sentence}});
}

namespace {

constexpr std::int64_t kReplyWithin_ns = 5 * kNanosPerSecond;
constexpr std::int64_t kGone_ns = 10 * kNanosPerSecond;  // a stream without any message
// Since the skeleton came last: the daemon repeats those of all streams each second.
constexpr std::int64_t kStayed_ns = 3 * kNanosPerSecond / 2;
constexpr std::int64_t kUpload_ns = 10 * kNanosPerSecond;  // between two pieces, as in the daemon
constexpr std::size_t kMaxTopic = 128;
constexpr std::array<std::string_view, 4> kKindNames{"skeleton/", "pose/", "sensor/", "event/"};

}  // namespace

void Hub::join(Tab& tab) {
  tabs_.insert(&tab);
  tab.outbox.put_answer(hello_word(greeting_, right_));
  tab.outbox.put_answer(daemon_word(daemon_));
  if (stats_) tab.outbox.put_newest("stats", stats_);
  for (const auto& [name, stream] : streams_) {
    if (stream.skeleton) tab.outbox.put_newest(stream.topics[kSkeleton], stream.skeleton);
  }
  tab.wake();
}

void Hub::leave(Tab& tab) {
  tabs_.erase(&tab);
  if (uploader_ == &tab) uploader_ = nullptr;
  if (camera_ == &tab) end_camera();
  std::erase_if(under_way_, [&](const auto& entry) { return entry.second.tab == &tab; });
}

void Hub::handle(Tab& tab, std::string_view bytes, bool text, std::int64_t now_ns) {
  if (!tabs_.contains(&tab)) return;
  if (text) {
    const PageWord word = read_word(bytes);
    if (std::holds_alternative<ReadyWord>(word)) tab.outbox.ready();
    if (const auto* clock = std::get_if<ClockWord>(&word)) {
      tab.outbox.put_answer(clock_word(clock->t0, now_ns));
    }
    if (const auto* landmarks = std::get_if<LandmarksWord>(&word)) {
      feed(tab, landmarks->json, now_ns);
    }
  } else if (const auto asked = read_request(bytes)) {
    ask(tab, *asked, now_ns);
  }
  tab.wake();
}

std::string Hub::reason_against(const Tab& tab, const PageRequest& asked,
                                std::int64_t now_ns) const {
  if (!right_.may) return right_.reason;
  if (!asked.refusal.empty()) return asked.refusal;
  if (tab.under_way >= kMaxUnderWay) {
    return "too many requests at once: wait for the answers to those before";
  }
  const bool others_upload =
      uploader_ != nullptr && uploader_ != &tab && now_ns - upload_ns_ < kUpload_ns;
  if (asked.request.has_model_part() && others_upload) {
    return "another page is sending a model; try again in some seconds";
  }
  return {};
}

std::string Hub::reason_against_landmarks(const Tab& tab, const std::string& json,
                                          std::int64_t now_ns) {
  if (!right_.may) return right_.reason;
  if (!feed_ || !greeting_.same_machine) {
    return "the camera's hands go only to a daemon on this computer: open the page of `posed view`"
           " there";
  }
  if (json.empty()) return "this is not a message of landmarks (drivers/landmarks/README.md)";
  if (camera_ != nullptr && camera_ != &tab && now_ns - camera_ns_ < kNanosPerSecond) {
    return "another page is using its camera; stop that one first";
  }
  if (now_ns - second_ns_ >= kNanosPerSecond) {
    second_ns_ = now_ns;
    this_second_ = 0;
  }
  if (this_second_ >= kMaxLandmarks_hz) return "too many messages a second";
  ++this_second_;
  camera_ = &tab;
  camera_ns_ = now_ns;
  return feed_(hands_source_, json);
}

void Hub::end_camera() {
  camera_ = nullptr;
  static_cast<void>(feed_(hands_source_, kCameraEnds));
}

void Hub::feed(Tab& tab, const std::string& json, std::int64_t now_ns) {
  const std::string reason = reason_against_landmarks(tab, json, now_ns);
  if (reason.empty()) {
    ++counts_.landmarks;
    return;
  }
  ++counts_.refused_landmarks;
  if (tab.told_ns != kNoTime_ns && now_ns - tab.told_ns < kNanosPerSecond) return;
  tab.told_ns = now_ns;
  tab.outbox.put_answer(landmarks_word(reason));
}

void Hub::note_upload(Tab& tab, const v1::ControlRequest& request, std::int64_t now_ns) {
  if (!request.has_model_part()) return;
  const auto& part = request.model_part();
  const bool last = part.bytes().size() >= part.total() - std::min(part.offset(), part.total());
  uploader_ = last ? nullptr : &tab;
  upload_ns_ = now_ns;
}

void Hub::ask(Tab& tab, const PageRequest& asked, std::int64_t now_ns) {
  std::string reason = reason_against(tab, asked, now_ns);
  if (reason.empty()) {
    if (ask_(++last_ticket_, asked.request.SerializeAsString())) {
      note_upload(tab, asked.request, now_ns);
      under_way_[last_ticket_] = {&tab, asked.number, now_ns + kReplyWithin_ns};
      ++tab.under_way;
      ++counts_.passed;
      return;
    }
    reason = "the daemon cannot be reached now, so nothing was changed";
  }
  ++counts_.refused;
  tab.outbox.put_answer(refusal_reply(asked.number, reason));
}

void Hub::replied(std::uint64_t ticket, std::string_view reply) {
  const auto found = under_way_.find(ticket);
  if (found == under_way_.end()) return;  // too late, or the page has been closed
  const UnderWay asked = found->second;
  under_way_.erase(found);
  --asked.tab->under_way;
  asked.tab->outbox.put_answer({.bytes = with_topic(reply_topic(asked.number), reply)});
  asked.tab->wake();
}

void Hub::receive(std::string_view topic, std::string_view body, std::int64_t now_ns) {
  if (topic.size() > kMaxTopic) {
    ++counts_.foreign;
  } else if (topic == "stats") {
    stats_ = with_topic(topic, body);
    hands_source_ = hands_source_of(body);
    for (Tab* tab : tabs_) tab->outbox.put_newest("stats", stats_);
  } else {
    receive_stream(topic, body, now_ns);
  }
}

Bytes Hub::counted(const Stream& stream, std::string_view topic, std::string_view body) const {
  Bytes bytes = with_topic(topic, body);
  const std::string* const text = bytes.get();
  *kept_ += text->size();
  *stream.kept += text->size();
  return {text, [all = kept_, own = stream.kept, owner = std::move(bytes)](const auto* gone) {
            *all -= gone->size();
            *own -= gone->size();
          }};
}

Hub::Stream* Hub::meet(std::string_view name, std::int64_t now_ns) {
  auto known = streams_.find(name);
  if (known == streams_.end()) {
    constexpr std::int64_t kPause_ns = kNanosPerSecond / 10;  // it looks at all of them
    if (streams_.size() == kMaxViewStreams && now_ns - forgot_ns_ >= kPause_ns) {
      forgot_ns_ = now_ns;
      forget_silent(now_ns, kStayed_ns);
    }
    if (streams_.size() == kMaxViewStreams) return nullptr;
    known = streams_.emplace(std::string(name), Stream{}).first;
    for (std::size_t kind = 0; kind < kEvent; ++kind) {
      known->second.topics[kind] = std::string(kKindNames[kind]).append(name);
    }
  }
  known->second.received_ns = now_ns;
  return &known->second;
}

bool Hub::make_room(const Stream& stream, std::size_t bytes) {
  if (*kept_ + bytes <= kMaxKeptBytes) return true;
  const std::size_t share = kMaxKeptBytes / streams_.size();
  if (*stream.kept + bytes > share) return false;
  for (auto& [name, one] : streams_) {
    if (*one.kept > share) let_go(one);  // but what is being sent, and events
    if (*kept_ + bytes <= kMaxKeptBytes) return true;
  }
  return false;
}

void Hub::receive_stream(std::string_view topic, std::string_view body, std::int64_t now_ns) {
  const auto kind = std::ranges::find_if(
      kKindNames, [&](std::string_view name) { return topic.starts_with(name); });
  const bool event = kind == kKindNames.begin() + kEvent;
  const bool fits = body.size() <= (event ? kMaxEventBytes : link::kMaxStreamMessage);
  Stream* const stream =
      kind != kKindNames.end() && fits ? meet(topic.substr(kind->size()), now_ns) : nullptr;
  if (stream == nullptr) {
    ++counts_.foreign;
    return;
  }
  const bool skeleton = kind == kKindNames.begin() + kSkeleton;
  if (tabs_.empty() && !skeleton) return;
  if (skeleton) {
    // The daemon repeats it every second, for clients that come later. After a pause the stream had
    // left, and pages have forgotten its skeleton.
    const bool stayed = now_ns - std::exchange(stream->skeleton_ns, now_ns) < kStayed_ns;
    const bool same =
        stream->skeleton && std::string_view(*stream->skeleton).substr(1 + topic.size()) == body;
    if (stayed && same) return;
  }
  if (!make_room(*stream, topic.size() + 1 + body.size())) {
    ++counts_.foreign;
    return;
  }
  const Bytes bytes = counted(*stream, topic, body);
  if (event) {
    for (Tab* tab : tabs_) tab->outbox.put_event(bytes);
    return;
  }
  const std::string& key = stream->topics[static_cast<std::size_t>(kind - kKindNames.begin())];
  if (skeleton) stream->skeleton = bytes;
  for (Tab* tab : tabs_) {
    if (skeleton) {
      tab->outbox.put_newest(key, bytes);
    } else {
      tab->outbox.put_thinned(key, bytes);
    }
  }
}

void Hub::flush() {
  for (Tab* tab : tabs_) tab->wake();
}

void Hub::daemon_is(DaemonState state) {
  if (state == daemon_) return;
  if (!state.alive && daemon_.alive) {
    // What the next one has may differ, and poses of this one would be old.
    for (Tab* tab : tabs_) tab->outbox.forget_all();
    streams_.clear();
    stats_ = nullptr;
    hands_source_.clear();
  }
  daemon_ = std::move(state);
  send_to_all(daemon_word(daemon_));
}

void Hub::control_is(ControlRight right) {
  if (right == right_) return;
  right_ = std::move(right);
  send_to_all(control_word(right_));
}

void Hub::send_to_all(const Parcel& parcel) {
  for (Tab* tab : tabs_) {
    tab->outbox.put_answer(parcel);
    tab->wake();
  }
}

void Hub::let_go(Stream& stream) {
  for (Tab* tab : tabs_) {
    for (const std::string& topic : stream.topics) tab->outbox.forget(topic);
  }
  stream.skeleton = nullptr;
}

void Hub::forget_silent(std::int64_t now_ns, std::int64_t silent_ns) {
  for (auto next = streams_.begin(); next != streams_.end();) {
    const auto one = next++;
    if (now_ns - one->second.received_ns < silent_ns) continue;
    let_go(one->second);
    streams_.erase(one);
  }
}

void Hub::expire(std::int64_t now_ns) {
  while (!under_way_.empty()) {
    const auto oldest = under_way_.begin();  // tickets count up
    if (now_ns < oldest->second.due_ns) break;
    const UnderWay asked = oldest->second;
    under_way_.erase(oldest);
    --asked.tab->under_way;
    ++counts_.no_reply;
    asked.tab->outbox.put_answer(no_reply_word(
        asked.number, "the daemon has not answered for 5 s; the change may still take effect"));
    asked.tab->wake();
  }
  if (camera_ != nullptr && now_ns - camera_ns_ > kCameraSilent_ns) end_camera();
  forget_silent(now_ns, kGone_ns);
}

}  // namespace posed::view
