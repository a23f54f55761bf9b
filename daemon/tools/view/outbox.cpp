#include "daemon/tools/view/outbox.hpp"

#include <utility>

namespace posed::view {

void Outbox::put_thinned(std::string_view topic, Bytes bytes) {
  Thinned& thinned = thinned_[topic];
  if (thinned.bytes) ++counts_.replaced;
  thinned.bytes = std::move(bytes);
}

void Outbox::put_newest(std::string_view topic, Bytes bytes) { newest_[topic] = std::move(bytes); }

void Outbox::put_event(Bytes bytes) {
  if (events_.size() == kMaxEvents) {
    events_.pop_front();
    ++counts_.dropped;
  }
  events_.push_back(std::move(bytes));
}

void Outbox::put_answer(Parcel parcel) {
  if (answers_.size() == kMaxAnswers) {
    answers_.pop_front();
    ++counts_.dropped;
  }
  answers_.push_back(std::move(parcel));
}

void Outbox::forget(std::string_view topic) {
  newest_.erase(topic);
  thinned_.erase(topic);
}

void Outbox::forget_all() {
  newest_.clear();
  thinned_.clear();
}

std::optional<Parcel> Outbox::next() {
  Parcel parcel;
  if (!answers_.empty()) {
    parcel = std::move(answers_.front());
    answers_.pop_front();
  } else if (!events_.empty()) {
    parcel.bytes = std::move(events_.front());
    events_.pop_front();
  } else if (!newest_.empty()) {
    parcel.bytes = std::move(newest_.begin()->second);
    newest_.erase(newest_.begin());
  } else {
    parcel.bytes = next_thinned();
  }
  if (!parcel.bytes) return std::nullopt;
  ++counts_.sent;
  return parcel;
}

// Goes on behind the one that was sent last, so that a page which is slower than the streams sees
// all of them in turn.
Bytes Outbox::next_thinned() {
  auto at = thinned_.upper_bound(last_);
  for (std::size_t seen = 0; seen < thinned_.size(); ++seen, ++at) {
    if (at == thinned_.end()) at = thinned_.begin();
    auto& [topic, thinned] = *at;
    if (!thinned.bytes || thinned.sent_credit == credit_) continue;
    last_ = topic;
    thinned.sent_credit = credit_;
    return std::exchange(thinned.bytes, nullptr);
  }
  return nullptr;
}

}  // namespace posed::view
