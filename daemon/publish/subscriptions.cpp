#include "daemon/publish/subscriptions.hpp"

#include <algorithm>
#include <array>

#include "proto/frame/time.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::publish {
namespace {

constexpr std::size_t kMaxName = kMaxStreamName + kRawSuffix.size();
constexpr std::array<std::string_view, 4> kTopicKinds{"pose/", "skeleton/", "sensor/", "event/"};

bool is_name_sign(char sign) {
  return (sign >= 'a' && sign <= 'z') || (sign >= '0' && sign <= '9') || sign == '_' || sign == '-';
}

}  // namespace

bool could_become_topic(std::string_view prefix) {
  if (std::string_view("stats").starts_with(prefix)) return true;
  return std::ranges::any_of(kTopicKinds, [&](std::string_view kind) {
    if (kind.starts_with(prefix)) return true;
    if (!prefix.starts_with(kind)) return false;
    const std::string_view name = prefix.substr(kind.size());
    return name.size() <= kMaxName && std::ranges::all_of(name, is_name_sign);
  });
}

bool Subscriptions::within_budget(Peer& peer, std::int64_t now_ns) const {
  const double earned = seconds(std::max<std::int64_t>(now_ns - peer.asked_ns, 0)) * kMaxPerSecond;
  peer.budget = std::min(peer.budget + earned, kMaxAtOnce) - 1.0;
  peer.asked_ns = now_ns;
  return peer.budget >= 0.0;
}

bool Subscriptions::ask(int peer_id, std::string_view prefix, bool on, std::int64_t now_ns) {
  Peer& peer = peers_[peer_id];
  if (!within_budget(peer, now_ns)) return false;
  const auto found = peer.waits.find(prefix);
  const bool possible = could_become_topic(prefix);
  if (!on) {
    if (found == peer.waits.end()) return true;
    if (possible) {
      drop(*found);
    } else {
      --peer.impossible;
    }
    peer.waits.erase(found);
    return true;
  }
  if (found != peer.waits.end() || is_topic_(prefix)) return true;
  peer.waits.emplace(prefix);
  if (!possible) return ++peer.impossible <= kMaxImpossible;
  const auto wanted = wanted_.try_emplace(std::string(prefix), 0).first;
  if (++wanted->second == 1 && changed_) changed_(wanted->first, true);
  return wanted_.size() <= kMaxWanted && peer.waits.size() - peer.impossible <= kMaxWantedOfPeer;
}

void Subscriptions::drop(const std::string& prefix) {
  const auto wanted = wanted_.find(prefix);
  if (--wanted->second > 0) return;
  if (changed_) changed_(prefix, false);
  wanted_.erase(wanted);
}

void Subscriptions::forget(int peer_id) {
  const auto found = peers_.find(peer_id);
  if (found == peers_.end()) return;
  for (const std::string& prefix : found->second.waits) {
    if (could_become_topic(prefix)) drop(prefix);
  }
  peers_.erase(found);
}

}  // namespace posed::publish
