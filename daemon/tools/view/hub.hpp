// Hub: what the bridge knows, and who gets what; and the messages between the bridge and a page.
// The page's are untrusted. No socket and no clock of its own; one thread. Cold.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <variant>

#include "daemon/tools/link/daemon_socket.hpp"
#include "daemon/tools/view/outbox.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::view {

// The messages between the bridge and a page. From the page: a word in JSON (text), or a numbered
// request to the daemon (binary). To the page: what the daemon published behind its topic (binary),
// and the bridge's own words in JSON (text). The page's are untrusted. No socket; pure functions.
//

// Bytes of a message of the page: a request of the largest size that a daemon takes, numbered.
inline constexpr std::size_t kMaxPageMessage = 64 * 1024 + 4;
inline constexpr std::size_t kMaxWord = 1024;  // bytes of its JSON
inline constexpr std::size_t kMaxLandmarksWord = 8 * 1024;
// Of all pages together: no camera is faster.
inline constexpr int kMaxLandmarks_hz = 120;

struct ReadyWord {};  // the page can show one more pose of each stream
struct ClockWord {    // asks for the bridge's clock
  double t0 = 0.0;    // the page's own time, given back
};
// Hands that the page finds in its camera's picture (drivers/landmarks/protocol.hpp), written anew,
// so that only what was checked passes; empty if they are none.
struct LandmarksWord {
  std::string json;
};
struct UnknownWord {};  // of a newer page, or nonsense: ignored
using PageWord = std::variant<UnknownWord, ReadyWord, ClockWord, LandmarksWord>;

[[nodiscard]] PageWord read_word(std::string_view text);

struct PageRequest {
  std::uint32_t number = 0;  // the page's, for the reply
  v1::ControlRequest request{};
  std::string refusal{};  // why it does not pass, one sentence; empty: it may pass
};

// An Error if there is not even a number.
Result<PageRequest> read_request(std::string_view bytes);

// What the daemon published: the length of the topic, the topic, the body. The topic has at most
// 255 bytes.
[[nodiscard]] Bytes with_topic(std::string_view topic, std::string_view body);
// The topic of the reply to a request of the page.
[[nodiscard]] std::string reply_topic(std::uint32_t number);
// A reply that the bridge gives itself: refused, and why.
[[nodiscard]] Parcel refusal_reply(std::uint32_t number, const std::string& sentence);

// Whether the page may change anything, and why not.
struct ControlRight {
  bool may = false;
  std::string reason = "not known yet";  // empty when it may
  bool operator==(const ControlRight&) const = default;
};
// Whether the daemon answers, in words.
struct DaemonState {
  bool alive = false;
  std::string sentence{};
  bool operator==(const DaemonState&) const = default;
};
struct Greeting {
  std::string version{};
  std::string connect{};      // the daemon's endpoint
  bool same_machine = false;  // the daemon's clock is the bridge's
  bool camera = false;        // the page has what finds hands in a picture
};

[[nodiscard]] Parcel hello_word(const Greeting& greeting, const ControlRight& right);
[[nodiscard]] Parcel control_word(const ControlRight& right);
[[nodiscard]] Parcel daemon_word(const DaemonState& state);
[[nodiscard]] Parcel clock_word(double t0, std::int64_t monotonic_ns);
[[nodiscard]] Parcel landmarks_word(const std::string& refusal);
[[nodiscard]] Parcel no_reply_word(std::uint32_t number, const std::string& sentence);

inline constexpr std::size_t kMaxViewStreams = link::kMaxLinkStreams;  // more are not shown
// Bytes of all streams' messages that are kept for the pages: those of a large setup have some MB.
// Where there are more, streams with more than an equal share of them are not shown.
inline constexpr std::size_t kMaxKeptBytes = 32 * 1024 * 1024;
inline constexpr std::size_t kMaxEventBytes = 8 * 1024;  // they have a sentence each
inline constexpr std::size_t kMaxUnderWay = 8;           // requests of one page at once

// An open page.
struct Tab {
  Outbox outbox{};
  // Sends what is in the outbox, if it can. Called when something may have come into it.
  std::function<void()> wake{};
  std::size_t under_way = 0;  // requests without a reply
  // When it was told last why its landmarks do not pass: once a second is enough.
  std::int64_t told_ns = kNoTime_ns;
};

struct HubCounts {
  std::uint64_t foreign = 0;   // messages of the daemon that are none of posed's, or too many
  std::uint64_t passed = 0;    // requests to the daemon
  std::uint64_t refused = 0;   // requests that the bridge did not pass on
  std::uint64_t no_reply = 0;  // requests that the daemon did not answer in time
  std::uint64_t landmarks = 0, refused_landmarks = 0;  // messages passed on, and not
};

// The daemon's messages go to every open page, the pages' requests to the daemon, and each reply
// back to the page that asked.
class Hub {
 public:
  // Sends a request to the daemon's control socket under a ticket; returns false if it cannot be
  // sent now.
  using Ask = std::function<bool(std::uint64_t ticket, std::string_view request)>;

  // Sends landmarks to the daemon's source with this identity (empty: it has none); returns why
  // they did not go, empty if they did.
  using Feed = std::function<std::string(std::string_view source, std::string_view json)>;

  Hub(Greeting greeting, Ask ask, Feed feed = {})
      : greeting_(std::move(greeting)), ask_(std::move(ask)), feed_(std::move(feed)) {}

  // The tab gets what is known, and everything that comes until it leaves; it stays where it is.
  void join(Tab& tab);
  void leave(Tab& tab);
  [[nodiscard]] std::size_t tabs() const noexcept { return tabs_.size(); }

  // A message of the page; `text`: not binary. That of a tab that has left changes nothing: its
  // connection may have read it before it ended.
  void handle(Tab& tab, std::string_view bytes, bool text, std::int64_t now_ns);

  // A message of the daemon's publish socket. Call flush() after the last one that waited.
  void receive(std::string_view topic, std::string_view body, std::int64_t now_ns);
  void flush();
  // A reply of the daemon's control socket.
  void replied(std::uint64_t ticket, std::string_view reply);

  // What is known about the daemon; every page is sent a change.
  void daemon_is(DaemonState state);
  void control_is(ControlRight right);
  [[nodiscard]] const DaemonState& daemon() const noexcept { return daemon_; }
  [[nodiscard]] const ControlRight& right() const noexcept { return right_; }

  // Gives up requests without a reply and streams that are silent. Call from time to time.
  void expire(std::int64_t now_ns);
  [[nodiscard]] const HubCounts& counts() const noexcept { return counts_; }
  // Bytes of streams that are kept, here and in the outboxes.
  [[nodiscard]] std::size_t kept_bytes() const noexcept { return *kept_; }

 private:
  enum Kind : std::uint8_t { kSkeleton, kPose, kSensor, kEvent };
  struct Stream {
    std::array<std::string, kEvent> topics{};  // the tabs' outboxes refer to them
    std::int64_t received_ns = 0;
    Bytes skeleton{};              // with its topic; null: none yet
    std::int64_t skeleton_ns = 0;  // when it came last
    std::shared_ptr<std::size_t> kept = std::make_shared<std::size_t>(0);  // bytes
  };
  struct UnderWay {
    Tab* tab = nullptr;
    std::uint32_t number = 0;
    std::int64_t due_ns = 0;
  };
  void ask(Tab& tab, const PageRequest& asked, std::int64_t now_ns);
  // Why this request may not pass now; empty: it may.
  [[nodiscard]] std::string reason_against(const Tab& tab, const PageRequest& asked,
                                           std::int64_t now_ns) const;
  void feed(Tab& tab, const std::string& json, std::int64_t now_ns);
  [[nodiscard]] std::string reason_against_landmarks(const Tab& tab, const std::string& json,
                                                     std::int64_t now_ns);
  // Tells the daemon that the page's camera is off.
  void end_camera();
  void note_upload(Tab& tab, const v1::ControlRequest& request, std::int64_t now_ns);
  // The message behind its topic, counted in both `kept` for as long as anybody has it.
  [[nodiscard]] Bytes counted(const Stream& stream, std::string_view topic,
                              std::string_view body) const;
  void receive_stream(std::string_view topic, std::string_view body, std::int64_t now_ns);
  // The stream of this name, perhaps a new one; null if there are too many.
  [[nodiscard]] Stream* meet(std::string_view name, std::int64_t now_ns);
  // Whether so many more bytes of the stream may be kept. Where there is no room, streams with more
  // than an equal share give way to those with less: no source hides the usual streams of another.
  [[nodiscard]] bool make_room(const Stream& stream, std::size_t bytes);
  void send_to_all(const Parcel& parcel);
  // Keeps nothing of the stream that can be left out.
  void let_go(Stream& stream);
  void forget_silent(std::int64_t now_ns, std::int64_t silent_ns);

  Greeting greeting_;
  Ask ask_;
  Feed feed_;
  std::set<Tab*> tabs_;
  DaemonState daemon_;
  ControlRight right_;
  std::map<std::string, Stream, std::less<>> streams_;
  std::int64_t forgot_ns_ = kNoTime_ns / 2;      // when there were too many of them
  Bytes stats_;                                  // the last ones, with their topic; null: none
  std::map<std::uint64_t, UnderWay> under_way_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  // The daemon sees one client, which may send one model at a time.
  const Tab* uploader_ = nullptr;
  std::int64_t upload_ns_ = 0;
  // The page whose camera is used: hands of two would be mixed.
  const Tab* camera_ = nullptr;
  std::int64_t camera_ns_ = 0;
  std::string hands_source_;    // identity of the daemon's landmarks source; empty: it has none
  std::int64_t second_ns_ = 0;  // since when landmarks are counted
  int this_second_ = 0;
  std::shared_ptr<std::size_t> kept_ = std::make_shared<std::size_t>(0);  // bytes
  HubCounts counts_;
};

}  // namespace posed::view
