#include "daemon/tools/relay/relayed_streams.hpp"

#include <algorithm>

#include "daemon/system/event_fd.hpp"
#include "proto/frame/time.hpp"

namespace posed::relay {
namespace {

constexpr std::string_view kSkeleton = "skeleton/";
constexpr std::int64_t kSkeletonPause_ns = kNanosPerSecond / 20;
// A daemon sends each skeleton every second. After this silence another upstream may have the name.
constexpr std::int64_t kSilent_ns = 3 * kNanosPerSecond;
// After this one the stream has gone.
constexpr std::int64_t kGone_ns = 10 * kNanosPerSecond;

}  // namespace

std::string_view stream_of_topic(std::string_view topic) {
  const auto slash = topic.find('/');
  return slash == std::string_view::npos ? std::string_view() : topic.substr(slash + 1);
}

bool RelayedStreams::admit(std::string_view stream, std::size_t upstream, std::int64_t now_ns) {
  forget_old(now_ns);
  auto found = streams_.find(stream);
  if (found == streams_.end()) {
    if (streams_.size() == kMaxStreams) return false;
    Stream fresh{.upstream = upstream};
    fresh.due_ns = system::kForever_ns;
    found = streams_.emplace(std::string(stream), std::move(fresh)).first;
  } else if (found->second.upstream != upstream) {
    if (now_ns - found->second.heard_ns < kSilent_ns) return false;
    found->second.upstream = upstream;
  }
  found->second.heard_ns = now_ns;
  return true;
}

void RelayedStreams::keep_skeleton(std::string_view stream, std::string_view bytes,
                                   std::int64_t now_ns) {
  const auto found = streams_.find(stream);
  if (found == streams_.end()) return;
  Stream& kept = found->second;
  skeleton_bytes_ -= kept.skeleton.size();
  kept.skeleton.clear();
  kept.due_ns = system::kForever_ns;
  if (skeleton_bytes_ + bytes.size() > kMaxSkeletonBytes) return;
  kept.skeleton_topic = std::string(kSkeleton) + found->first;
  kept.skeleton = bytes;
  kept.sent_ns = now_ns;
  skeleton_bytes_ += bytes.size();
}

void RelayedStreams::want_skeletons(std::string_view prefix) {
  for (auto& [name, stream] : streams_) {
    if (stream.skeleton.empty() || !stream.skeleton_topic.starts_with(prefix)) continue;
    stream.due_ns = std::min(stream.due_ns, stream.sent_ns + kSkeletonPause_ns);
  }
}

std::int64_t RelayedStreams::send_due(
    std::int64_t now_ns,
    const std::function<void(std::string_view topic, std::string_view bytes)>& send) {
  std::int64_t next_ns = system::kForever_ns;
  for (auto& [name, stream] : streams_) {
    if (now_ns >= stream.due_ns) {
      send(stream.skeleton_topic, stream.skeleton);
      stream.sent_ns = now_ns;
      stream.due_ns = system::kForever_ns;
    }
    next_ns = std::min(next_ns, stream.due_ns);
  }
  return next_ns;
}

void RelayedStreams::forget_old(std::int64_t now_ns) {
  if (now_ns < forgot_ns_ + kNanosPerSecond) return;
  forgot_ns_ = now_ns;
  std::erase_if(streams_, [&](const auto& entry) {
    const Stream& stream = entry.second;
    if (now_ns - stream.heard_ns < kGone_ns) return false;
    skeleton_bytes_ -= stream.skeleton.size();
    return true;
  });
}

}  // namespace posed::relay
