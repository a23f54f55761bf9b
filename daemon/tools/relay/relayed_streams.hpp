// RelayedStreams: what a relay knows of the streams that pass it. Each stream belongs to the
// upstream that sends it; a second one that sends a stream of the same name is not mixed in. The
// last skeleton of each stream is kept for subscribers that come later. No socket, no clock of its
// own, one thread. Cold: allocates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace posed::relay {

inline constexpr std::size_t kMaxStreams = 1024;
inline constexpr std::size_t kMaxSkeletonBytes = 16 * 1024 * 1024;  // of all streams together

// The stream of a topic such as "pose/walker"; empty for other topics.
[[nodiscard]] std::string_view stream_of_topic(std::string_view topic);

class RelayedStreams {
 public:
  // A message of the stream came from an upstream (its index). Returns false if it may not pass: if
  // another upstream sends a stream of this name, or if there are kMaxStreams others.
  [[nodiscard]] bool admit(std::string_view stream, std::size_t upstream, std::int64_t now_ns);

  // The skeleton of an admitted stream has just been passed on. One beyond kMaxSkeletonBytes is not
  // kept.
  void keep_skeleton(std::string_view stream, std::string_view bytes, std::int64_t now_ns);

  // Somebody has subscribed to the topics that begin with `prefix`: their skeletons become due, at
  // once or 50 ms after they were last sent, because all their subscribers get them again.
  void want_skeletons(std::string_view prefix);

  // Gives the skeletons that are due to `send`; returns when the next one is.
  [[nodiscard]] std::int64_t send_due(
      std::int64_t now_ns,
      const std::function<void(std::string_view topic, std::string_view bytes)>& send);

  [[nodiscard]] std::size_t streams() const noexcept { return streams_.size(); }
  [[nodiscard]] std::size_t skeleton_bytes() const noexcept { return skeleton_bytes_; }

 private:
  struct Stream {
    std::size_t upstream = 0;
    std::int64_t heard_ns = 0;
    std::string skeleton_topic{}, skeleton{};  // empty: none is kept
    std::int64_t sent_ns = 0, due_ns = 0;      // of the skeleton
  };
  // Forgets streams that have not been heard for a while; at most once a second.
  void forget_old(std::int64_t now_ns);

  std::map<std::string, Stream, std::less<>> streams_;
  std::size_t skeleton_bytes_ = 0;
  std::int64_t forgot_ns_ = 0;
};

}  // namespace posed::relay
