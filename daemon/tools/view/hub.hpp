// Hub: what the bridge knows, and who gets what. The daemon's messages go to every open page, the
// pages' requests to the daemon, and each reply back to the page that asked. No socket and no clock
// of its own; one thread. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "daemon/tools/view/outbox.hpp"
#include "daemon/tools/view/page_message.hpp"

namespace posed::view {

inline constexpr std::size_t kMaxViewStreams = 1024;  // more are not shown
inline constexpr std::size_t kMaxUnderWay = 8;        // requests of one page at once

// An open page.
struct Tab {
  Outbox outbox{};
  // Sends what is in the outbox, if it can. Called when something may have come into it.
  std::function<void()> wake{};
  std::size_t under_way = 0;  // requests without a reply
};

struct HubCounts {
  std::uint64_t foreign = 0;   // messages of the daemon that are none of posed's, or too many
  std::uint64_t passed = 0;    // requests to the daemon
  std::uint64_t refused = 0;   // requests that the bridge did not pass on
  std::uint64_t no_reply = 0;  // requests that the daemon did not answer in time
};

class Hub {
 public:
  // Sends a request to the daemon's control socket under a ticket; returns false if it cannot be
  // sent now.
  using Ask = std::function<bool(std::uint64_t ticket, std::string_view request)>;

  Hub(Greeting greeting, Ask ask) : greeting_(std::move(greeting)), ask_(std::move(ask)) {}

  // The tab gets what is known, and everything that comes until it leaves; it stays where it is.
  void join(Tab& tab);
  void leave(Tab& tab);
  [[nodiscard]] std::size_t tabs() const noexcept { return tabs_.size(); }

  // A message of the page; `text`: not binary.
  void take(Tab& tab, std::string_view bytes, bool text, std::int64_t now_ns);

  // A message of the daemon's publish socket. Call flush() after the last one that waited.
  void heard(std::string_view topic, std::string_view body, std::int64_t now_ns);
  void flush();
  // A reply of the daemon's control socket.
  void replied(std::uint64_t ticket, std::string_view reply);

  // What is known about the daemon; every page is told of a change.
  void daemon_is(DaemonState state);
  void control_is(ControlRight right);
  [[nodiscard]] const DaemonState& daemon() const noexcept { return daemon_; }
  [[nodiscard]] const ControlRight& right() const noexcept { return right_; }

  // Gives up requests without a reply and streams that are silent. Call from time to time.
  void expire(std::int64_t now_ns);
  [[nodiscard]] const HubCounts& counts() const noexcept { return counts_; }

 private:
  struct Stream {
    std::int64_t heard_ns = 0;
    Bytes skeleton{};              // with its topic; null: none yet
    std::int64_t skeleton_ns = 0;  // when it came last
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
  void note_upload(Tab& tab, const v1::ControlRequest& request, std::int64_t now_ns);
  void hear_stream(std::string_view topic, std::string_view body, std::int64_t now_ns);
  void tell(const Parcel& parcel);
  void forget(std::string_view stream);

  Greeting greeting_;
  Ask ask_;
  std::set<Tab*> tabs_;
  DaemonState daemon_;
  ControlRight right_;
  std::map<std::string, Stream, std::less<>> streams_;
  Bytes stats_;                                  // the last ones, with their topic; null: none
  std::map<std::uint64_t, UnderWay> under_way_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  // The daemon sees one client, which may send one model at a time.
  const Tab* uploader_ = nullptr;
  std::int64_t upload_ns_ = 0;
  HubCounts counts_;
};

}  // namespace posed::view
