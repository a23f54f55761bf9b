// Outbox: what waits for one open page. Poses and samples wait for the page's credit, at most one
// of each stream, and newer ones replace them; everything else waits in bounded queues. So a page
// that does not read costs a fixed amount of memory and nobody any time. No socket, one thread.
// Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace posed::view {

// Shared, because all pages get the same bytes.
using Bytes = std::shared_ptr<const std::string>;

struct Parcel {
  Bytes bytes{};
  bool text = false;  // a WebSocket message of text, else a binary one
};

inline constexpr std::size_t kMaxEvents = 64;  // that wait; newer ones replace the oldest
// Replies and words of the bridge. Each but the few about the daemon answers a message of the page,
// which is not read while so many wait.
inline constexpr std::size_t kMaxAnswers = 64;

struct OutboxCounts {
  std::uint64_t sent = 0;      // messages
  std::uint64_t replaced = 0;  // poses and samples by newer ones, before they were sent
  std::uint64_t dropped = 0;   // events and answers that did not fit
};

class Outbox {
 public:
  // A pose or sample of the stream's topic. Topics outlive what waits of them: forget() comes
  // first.
  void put_thinned(std::string_view topic, Bytes bytes);
  // Of this only the newest matters: a skeleton, stats.
  void put_newest(std::string_view topic, Bytes bytes);
  void put_event(Bytes bytes);
  void put_answer(Parcel parcel);
  // Whether messages of the page should be read, because their answers have room.
  [[nodiscard]] bool has_room() const noexcept { return answers_.size() < kMaxAnswers / 2; }

  // The page can show more: of each topic one more message may go. Credits do not add up.
  void ready() noexcept { ++credit_; }
  // The stream has left, or what waits of it is old.
  void forget(std::string_view topic);
  // The daemon is not there any more: what waits of it is old.
  void forget_all();

  // What is to be sent now: answers, events, skeletons and stats, then poses and samples. Empty:
  // nothing.
  [[nodiscard]] std::optional<Parcel> next();
  [[nodiscard]] const OutboxCounts& counts() const noexcept { return counts_; }

 private:
  struct Thinned {
    Bytes bytes{};                  // null: the newest was sent
    std::uint64_t sent_credit = 0;  // with which the last one was sent
  };
  // The next pose or sample for which there is credit; null: none.
  Bytes next_thinned();

  std::deque<Parcel> answers_;
  std::deque<Bytes> events_;
  std::map<std::string_view, Bytes> newest_;  // by topic
  std::map<std::string_view, Thinned> thinned_;
  std::string last_;  // topic of the one of them that was sent last
  std::uint64_t credit_ = 0;
  OutboxCounts counts_;
};

}  // namespace posed::view
